"""A job run and judged on a machine that is a value of a script, not a file."""

from __future__ import annotations

import dataclasses
import json

import pytest

from pentapod import InputError, Job, Machine, judge, run


@pytest.fixture
def slow():
    """The desk machine with legs of half the speed, and a longer tool."""
    desk = Machine.load("desk")
    legs = dataclasses.replace(desk.legs, max_velocity=0.5 * desk.legs.max_velocity)
    return dataclasses.replace(desk, name="slow desk", legs=legs, tool_length=desk.tool_length + 1e-3)


def test_a_job_is_planned_and_judged_on_a_machine_of_a_script(make_job, tmp_path, slow):
    job = Job.load(make_job())
    outcome = run(job, tmp_path / "out", machine=slow)
    assert outcome.passed
    assert outcome.machine == slow
    written = json.loads((tmp_path / "out" / "verdict.json").read_text(encoding="utf-8"))
    assert written["sha256"]["machine"] is None  # no file: the program's header names it by its digest
    verdict = judge(job, tmp_path / "out", machine=slow)
    assert verdict.to_dict() == written
    failed = {c.claim for c in judge(job, tmp_path / "out").certificates if not c.passed}
    assert "machine" in failed


@pytest.mark.slow
def test_the_job_sets_period_and_tool_length_of_a_machine_of_a_script(make_job, tmp_path, slow):
    job = Job.load(
        make_job(("[feed]", "[output]\nperiod_ms = 2\n[feed]"), ("[toolpath]", "length_mm = 200\n[toolpath]"))
    )
    outcome = run(job, tmp_path / "out", machine=slow)
    assert (outcome.machine.controller.period, outcome.machine.tool_length) == (2e-3, 0.2)


@pytest.mark.parametrize("wrong", ["desk", 3, Machine])
def test_what_is_no_machine_is_one_clear_error(make_job, tmp_path, wrong):
    job = Job.load(make_job())
    for call in (run, judge):
        with pytest.raises(InputError, match=r"^machine: not a machine \(got .*\); expected a Machine; Machine\.load"):
            call(job, tmp_path / "out", machine=wrong)
    assert not (tmp_path / "out").exists()
