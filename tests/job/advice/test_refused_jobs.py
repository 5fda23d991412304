"""Sixty jobs that are refused as they stand: each gets advice, and the advice passes when it is planned."""

from __future__ import annotations

import pytest

from pentapod.base.errors import InputError
from pentapod.job import Job, advise, run
from pentapod.job.pipeline.advice_on_errors import can_help
from refused_jobs import REFUSED

pytestmark = [pytest.mark.slow, pytest.mark.parts]


def test_there_are_sixty():
    assert len(REFUSED) >= 60


@pytest.mark.parametrize("name", REFUSED)
def test_each_refused_job_gets_advice_that_passes(name, tmp_path, parts):
    job = Job.load(REFUSED[name].write(tmp_path, parts))
    try:
        outcome = run(job, tmp_path / "out")
        assert outcome.refusal is not None, "it is not refused: this set needs another job"
        advice = outcome.refusal.advice
    except InputError as error:
        if not can_help(error):
            raise
        advice = advise(job).advice
    assert advice
    for each in advice:
        assert 0.0 < each.kept <= 1.0
        again = run(job.with_(**each.tables), tmp_path / "again", advice=None)
        assert again.passed, (each.toml, again.refusal or [c for c in again.verdict.certificates if not c.passed])
