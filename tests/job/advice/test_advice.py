"""Advice for refused jobs: what is printed was planned, and passes when it is put into the job."""

from __future__ import annotations

import json
import tomllib

import pytest

from pentapod.base.advice import Advice, Change
from pentapod.base.errors import JobError
from pentapod.cli.main import run as run_cli
from pentapod.job import AdviceOptions, Job, advise, run
from pentapod.job.advice.search import Advised, advised
from pentapod.job.advise import can_help
from pentapod.job.build.values import job_machine, job_mesh
from refused_jobs import REFUSED

TOO_FAR = ("position_mm = [", "position_mm = [1000.0, 0, 700] # [")
METRES = ('unit = "mm"', 'unit = "m"')


def pasted(job, advice: Advice) -> Job:
    """The job with the TOML of an advice put into its tables, and what it says to take out left out."""
    content = tomllib.loads(job.read_text(encoding="utf-8"))
    for table, keys in tomllib.loads(advice.toml).items():
        content.setdefault(table, {}).update(keys)
    table = ""
    for line in advice.toml.splitlines():
        table = line.strip("[]") if line.startswith("[") else table
        if line.startswith("# take out "):
            del content[table][line.removeprefix("# take out ")]
    return Job.from_dict(content, job.parent)


def test_a_refusal_holds_advice_that_passes(make_job, tmp_path, capsys):
    job, out = make_job(TOO_FAR), tmp_path / "out"
    assert run_cli(["plan", str(job), "-o", str(out)]) == 1
    said = capsys.readouterr().err
    (written,) = json.loads((out / "verdict.json").read_text())["refusal"]["advice"]
    assert written["kept"] == 1.0
    assert written["toml"] in said
    assert "keeps all of the area" in said
    assert written["toml"] in (out / "report.html").read_text()
    changes = tuple(
        Change(table, key, value) for table, keys in written["changes"].items() for key, value in keys.items()
    )
    advice = Advice(changes, written["words"], written["kept"], written["whole"])
    assert run(pasted(job, advice), tmp_path / "again", advice=None).passed


def test_an_error_about_the_size_is_followed_by_advice(make_job, tmp_path, capsys):
    job = make_job(
        METRES, ('mode = "fixed"', 'mode = "free" #'), ("position_mm", "# position_mm"), ("rotation", "# rotation")
    )
    assert run_cli(["plan", str(job), "-o", str(tmp_path / "out"), "--json"]) == 2
    said = capsys.readouterr()
    assert said.err.startswith("error: ")
    assert 'unit = "mm"' in said.err
    (found,) = json.loads(said.out)["advice"]
    assert found["changes"]["part"] == {"unit": "mm"}
    assert not (tmp_path / "out").exists()


def test_no_search_where_none_is_wanted(make_job, tmp_path):
    outcome = run(Job.load(make_job(TOO_FAR)), tmp_path / "out", advice=None)
    assert outcome.refusal.advice == ()
    assert outcome.refusal.remedy == ""
    assert "advice" not in {stage.name for stage in outcome.stages}


def searched(folder, name, passes, **options) -> Advised:
    job = Job.load(REFUSED[name].write(folder))
    given = (job, job_machine(job), job_mesh(job), None, passes, AdviceOptions(**options))
    return advised(*given, lambda *_: None)


def test_what_fails_when_it_is_planned_is_no_advice(tmp_path):
    asked = []
    found = searched(tmp_path, "table too low", lambda job: bool(asked.append(job)), plans=2)
    assert found.advice == ()
    assert len(asked) == 2
    assert found.sentence.startswith("Tried: ")
    assert found.sentence.endswith(": none works")
    assert "another height of the table" in found.sentence


def test_the_best_comes_first(tmp_path):
    found = searched(tmp_path, "table too low", lambda _: True, wanted=3)
    assert len(found.advice) == 3
    first = found.advice[0]
    assert [(change.table, change.key) for change in first.changes] == [("placement", "table_z_mm")]
    assert 300.0 < first.changes[0].value < 600.0
    assert all(a.kept >= b.kept for a, b in zip(found.advice, found.advice[1:], strict=False))


def test_advice_in_toml():
    changes = (
        Change("axis", "mode", "fixed"),
        Change("axis", "direction", [0.0, 0.6, 0.8]),
        Change("axis", "tilt_deg", None),
        Change("part", "flip", True),
    )
    advice = Advice(changes, "one direction", 0.834)
    assert advice.toml.splitlines()[-3:] == ["# take out tilt_deg", "[part]", "flip = true"]
    assert tomllib.loads(advice.toml) == {
        "axis": {"mode": "fixed", "direction": [0.0, 0.6, 0.8]},
        "part": {"flip": True},
    }
    assert str(advice) == "one direction (keeps 83 % of the area)"
    assert str(Advice(changes, "smaller", 1.0, whole=False)) == "smaller (keeps all of the area, of another part)"


def test_errors_that_advice_can_help_with(make_job):
    assert can_help(JobError("too wide", key="part.unit"))
    assert not can_help(JobError("mistyped", key="part.unti"))
    with pytest.raises(JobError):
        advise(Job.load(make_job(("diameter_mm = 10", "diameter_mm = 10\nlength_mm = 5"))))
