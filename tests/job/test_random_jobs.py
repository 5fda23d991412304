"""Random jobs, of strategy, part, tool and tool axes: what is written passes its verdict; all else is refused."""

from __future__ import annotations

import pytest
from random_jobs import random_job

from pentapod.base.errors import InputError
from pentapod.job import judge, run


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(24))
def test_no_job_leaves_a_program_that_its_verdict_fails(seed, tmp_path):
    job, about = random_job(seed, tmp_path)
    out = tmp_path / "out"
    try:
        outcome = run(job, out, advice=None)
    except InputError:  # one line that says why, before anything is planned
        assert not out.exists()
        return
    assert (out / "program.csv").exists() == outcome.passed, about
    assert (outcome.refusal is None) == outcome.passed, about
    if outcome.passed:
        assert judge(job, out).passed, about
