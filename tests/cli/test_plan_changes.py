"""pentapod plan with other values of keys, and of several jobs; errors in the words of the job file."""

from __future__ import annotations

import json

import pytest

from pentapod.cli.main import run
from pentapod.job import Job

CHANGES = ["--set", "feed.cut_mm_min=1800", "--set", "placement.component = ++", "--set", 'tool.type="""\nball"""']


def test_other_values_are_planned_and_their_job_is_kept(make_job, tmp_path, capsys):
    job, out = make_job(), tmp_path / "out"
    assert run(["plan", str(job), "-o", str(out), *CHANGES, "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    changed = Job.load(out / "changed-job.toml")
    assert changed.feed.cut_mm_min == 1800.0
    assert changed.mesh_path.samefile(Job.load(job).mesh_path)
    assert run(["verify", str(out / "program.csv"), "--job", str(out / "changed-job.toml"), "-q"]) == 0
    assert run(["verify", str(out / "program.csv"), "--job", str(job)]) == 1
    assert "FAIL  job" in capsys.readouterr().out


@pytest.mark.slow
def test_the_job_of_other_values_stays_as_long_as_the_run_is_of_them(make_job, tmp_path):
    job, out = make_job(), tmp_path / "out"
    assert run(["plan", str(job), "-o", str(out), *CHANGES, "-q"]) == 0
    changed = Job.load(out / "changed-job.toml")
    assert run(["plan", str(out / "changed-job.toml"), "-o", str(out), "-q"]) == 0
    assert Job.load(out / "changed-job.toml").digest == changed.digest, "planned again it stays"
    assert run(["plan", str(job), "-o", str(out), "-q"]) == 0
    assert not (out / "changed-job.toml").exists(), "the run is not of those values any more"


def test_a_part_far_outside_the_work_volume_is_told(usual_run, make_job, tmp_path, capsys):
    """A table's height is easily mistyped, and the machine may still reach the part."""
    job, told = make_job(), "outside the machine's work volume; is its place right?"
    assert not any(told in stage.remark for stage in usual_run[2].stages)
    assert run(["plan", str(job), "-o", str(tmp_path / "b"), "--set", "placement.position_mm=[85, -17, 330]"]) == 0
    assert told in capsys.readouterr().out


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("feed", "--set: not a change of a key (got 'feed'); expected TABLE.KEY=VALUE"),
        ("feed.cut_mm_mn=3", 'feed.cut_mm_mn: unknown key; did you mean "cut_mm_min"?'),
        ("machine.legs.max_length_mm=3", "--set: not a change of a key"),
        ("feed.cut_mm_min=fast", "feed.cut_mm_min: wrong value (got 'fast'); expected number"),
        ("toolpath.stepover_mm=1e-7", "toolpath.stepover_mm: the passes are too dense for this mesh (got 1e-07)"),
        ("feed.cut_mm_min=1e-6", "feed: the program would have"),
    ],
)
def test_wrong_values_are_one_error_about_the_key(make_job, tmp_path, capsys, change, said):
    assert run(["plan", str(make_job()), "-o", str(tmp_path / "out"), "-q", "--advice", "0", "--set", change]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_several_jobs_are_planned_one_after_the_other(make_job, tmp_path, capsys):
    first, out = (
        make_job(("stepover_mm = 15\nspacing_mm = 4", "stepover_mm = 30\nspacing_mm = 8"), name="first.toml"),
        tmp_path / "out",
    )
    broken = make_job(("cut_mm_min", "cut"), name="broken.toml")
    assert run(["plan", str(broken), str(first), "-o", str(out), "--json"]) == 2
    said = capsys.readouterr()
    told = json.loads(said.out)
    assert [each["exit_code"] for each in told] == [2, 0]
    assert told[0]["error"] in said.err
    assert told[1]["passed"]
    assert (out / "first" / "program.csv").exists()
    assert not (out / "broken").exists()


def test_two_jobs_of_one_name_are_an_error(make_job, tmp_path, capsys):
    job = str(make_job())
    assert run(["plan", job, job, "-o", str(tmp_path / "out")]) == 2
    assert "two jobs of one name (got 'job')" in capsys.readouterr().err
