"""A job that one placement cannot do: its pieces, their files, and what is told of them."""

from __future__ import annotations

import json
import re
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from pentapod.base.errors import InputError, JobError
from pentapod.base.refusal import Refusal, Shortfall
from pentapod.cli.commands.new import dome_stl
from pentapod.cli.main import run as command
from pentapod.geometry.rigid import RigidTransform
from pentapod.job import Job, run, task
from pentapod.job.outcome import SetUps
from pentapod.job.pipeline import attempt, stages
from pentapod.machine.machine import Machine
from pentapod.planning import PlacedPath
from pentapod.program import read_csv
from pentapod.report import write_report
from pentapod.report.sheet import write_sheet
from pentapod.toolpath import Toolpath
from pentapod.toolpath.linking.partition import cutting_intervals
from pentapod.toolpath.toolpath import Segment, SegmentKind
from pentapod.view import open_run
from pentapod.view.replan import replanned
from pentapod.view.words import run_words
from usual_job import job_text

EACH = {"program.csv", "plan.npz", "verdict.json", "manifest.json"}


def text(setups: int = 3, scale: float = 3.0, stepover: float = 80, spacing: float = 20) -> str:
    """A dome of 180 mm that two poses of a fixture, 120 mm apart, reach together."""
    centre = Machine.load("desk").work.centre * 1e3 + (0.0, 0.0, 20.0)
    shift = np.array([60.0, 0.0, 0.0])
    places = np.round([centre - shift, centre + shift], 3).tolist()
    poses = [[*place, 180, 0, 0] for place in places]
    head = job_text().split("[placement]")[0].replace('unit = "mm"', f'unit = "mm"\nscale = {scale}')
    head = head.replace("stepover_mm = 15", f"stepover_mm = {stepover}").replace(
        "spacing_mm = 4", f"spacing_mm = {spacing}"
    )
    return f'{head}[placement]\nmode = "fixture"\nposes_mm_deg = {poses}\nsetups = {setups}\ncomponent = "++"\n'


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    folder = tmp_path_factory.mktemp("large")
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    (folder / "job.toml").write_text(text())
    return folder / "job.toml"


@pytest.fixture(scope="module")
def done(job):
    out = job.parent / "out"
    return out, run(Job.load(job), out, writers={"report.html": write_report, "sheet.html": write_sheet})


@pytest.fixture
def pieces(done, monkeypatch):
    """The search for pieces is over at once: those found before."""
    found = tuple(part.piece for part in done[1].find(SetUps).parts)
    monkeypatch.setattr(stages, "setups", lambda *_: found)


def test_each_set_up_has_its_files(done):
    out, outcome = done
    assert outcome.passed
    assert outcome.refusal is None
    setups = outcome.find(SetUps)
    assert len(setups.parts) == 2
    assert {p.name for p in out.iterdir()} == {
        "setup-1",
        "setup-2",
        "plan.npz",
        "verdict.json",
        "report.html",
        "sheet.html",
        "manifest.json",
    }
    for part in setups.parts:
        assert {p.name for p in (out / part.folder).iterdir()} == EACH | {"report.html", "sheet.html"}
        assert part.margin > 0.02
        assert part.duration == read_csv(out / part.folder / "program.csv").duration
        assert part.outcome.passed
    assert len({part.outcome.find(PlacedPath).placement.chosen_by for part in setups.parts}) == 2


def test_each_set_up_is_looked_at_by_itself(done):
    out, outcome = done
    with pytest.raises(InputError, match=r"several set-ups.*pentapod view .*setup-1"):
        open_run(out)
    second = outcome.find(SetUps).parts[1]
    assert open_run(out / second.folder).program.duration == second.duration


def test_a_set_up_is_planned_anew_by_itself(done, job, tmp_path, capsys):
    """Elsewhere, and without its program: the piece is known from the arrays as well. Half a run is told first."""
    whole, outcome = done
    second = outcome.find(SetUps).parts[1]
    shutil.copytree(job.parent, tmp_path / "copy")
    folder = tmp_path / "copy" / whole.name / second.folder
    (folder / "program.csv").unlink()
    with pytest.raises(InputError, match=r"program\.csv.*manifest\.json"):
        open_run(folder)
    (folder / "manifest.json").unlink()
    before = open_run(folder)
    assert before.piece == second.piece
    assert "One of several set-ups" in run_words(before)
    shifted = RigidTransform(before.placement.rotation, before.placement.translation + np.array([0.002, 0.0, 0.0]))
    anew = replanned(before, shifted)
    verdict = anew.outcome.verdict
    assert all(certificate.passed for certificate in verdict.certificates)
    assert [entry.claim for entry in verdict.not_judged] == [
        "every cut is made in one set-up"
    ]  # the others' are unknown
    assert anew.run.piece == second.piece
    made, planned = anew.run.toolpath, second.outcome.find(Toolpath)
    np.testing.assert_array_equal(made.tips, planned.tips)
    assert not (anew.folder / "setup-1").exists()
    head = job.read_text().split("[placement]")[0]
    (tmp_path / "copy" / "second.toml").write_text(f"{head}{anew.table}\n")
    program = anew.folder / "program.csv"
    # A job with one fixed placement is to be done in one set-up: a piece of it is not all of it.
    assert command(["verify", str(program), "--job", str(tmp_path / "copy" / "second.toml"), "--json"]) == 1
    failed = [c["claim"] for c in json.loads(capsys.readouterr().out)["certificates"] if not c["passed"]]
    assert failed == ["every cut is made in one set-up"]


def test_every_cut_is_made_once(done):
    _, outcome = done
    setups, toolpath = outcome.find(SetUps), outcome.find(Toolpath)
    times = np.sum([part.piece.cuts(toolpath) for part in setups.parts], axis=0)
    np.testing.assert_array_equal(times, cutting_intervals(toolpath))
    length = sum(  # of what the programs' own toolpaths cut, chord by chord
        float(np.linalg.norm(np.diff(segment.tips, axis=0), axis=1).sum())
        for part in setups.parts
        for segment in part.outcome.find(Toolpath).segments
        if segment.kind == "cut"
    )
    chords = np.linalg.norm(np.diff(toolpath.tips, axis=0), axis=1)
    assert length == pytest.approx(float(chords[cutting_intervals(toolpath)].sum()), rel=1e-12)


def test_verdict_and_report_of_several_set_ups_name_all(done):
    out, outcome = done
    verdict = json.loads((out / "verdict.json").read_text())
    assert verdict == outcome.to_dict()
    assert [entry["folder"] for entry in verdict["setups"]] == ["setup-1", "setup-2"]
    claims = [c["claim"] for c in verdict["certificates"]]
    assert claims[0] == "every cut is made in one set-up"
    assert "set-up 2: tip deviation" in claims
    parts = [json.loads((out / entry["folder"] / "verdict.json").read_text()) for entry in verdict["setups"]]
    assert len(claims) == 1 + sum(len(part["certificates"]) for part in parts)
    page = (out / "report.html").read_text()
    assert re.findall(r'href="(setup-\d/report.html)"', page) == ["setup-1/report.html", "setup-2/report.html"]
    assert "part stands" in (out / "setup-2" / "report.html").read_text()


def test_the_set_up_sheet_has_a_page_for_each(done, tmp_path):
    out, _ = done
    sheet = (out / "sheet.html").read_text()
    assert re.findall(r"<h1>([^<]*)</h1>", sheet) == [f"{out.parent.name}, set-up 1", f"{out.parent.name}, set-up 2"]
    own = [(out / folder / "sheet.html").read_text() for folder in ("setup-1", "setup-2")]
    for number, page in enumerate(own, start=1):
        assert re.findall(r"<h1>([^<]*)</h1>", page) == [f"{out.parent.name}, set-up {number}"]
        legs = read_csv(out / f"setup-{number}" / "program.csv").legs[0]
        assert ", ".join(f"{1e3 * leg:.3f}" for leg in legs) in page
    assert own[0] != own[1]
    for folder, wanted in ((out, sheet), (out / "setup-2", own[1])):
        assert command(["sheet", str(folder), "-o", str(tmp_path / "again.html")]) == 0
        assert (tmp_path / "again.html").read_text() == wanted


@pytest.mark.slow  # in the fast lane: a set-up planned anew is no whole job
def test_the_programs_together_are_the_job_and_one_alone_is_not(done, job, capsys):
    """The folder passes; a program alone leaves open who makes the other cuts; with another's piece it fails."""
    out, _ = done
    file = out / "setup-2" / "program.csv"
    assert command(["verify", str(out), "--job", str(job), "--strict", "-q"]) == 0
    capsys.readouterr()
    assert command(["verify", str(file), "--job", str(job), "--json"]) == 1
    verdict = json.loads(capsys.readouterr().out)
    assert all(certificate["passed"] for certificate in verdict["certificates"])
    assert [entry["claim"] for entry in verdict["not_judged"]] == ["every cut is made in one set-up"]
    other = (out / "setup-1" / "program.csv").read_text()
    lines = [re.search(r"# setup_box_mm = .*", content)[0] for content in (other, file.read_text())]
    wrong = out.parent / "wrong.csv"
    wrong.write_text(file.read_text().replace(lines[1], lines[0]))
    assert command(["verify", str(wrong), "--job", str(job), "-q"]) == 1
    assert capsys.readouterr().err == ""


@pytest.mark.slow
def test_too_few_set_ups_are_a_refusal_that_names_what_is_left(job, tmp_path):
    """So large that two poses never reach all of it; files of the run before are gone."""
    large = job.with_name("large.toml")
    large.write_text(text(setups=2, scale=4.5, stepover=45, spacing=9))
    old = tmp_path / "setup-1"
    old.mkdir()
    (old / "program.csv").write_text("")
    outcome = run(Job.load(large), tmp_path, advice=None)
    assert outcome.refusal.stage == "placement"
    assert outcome.refusal.diagnosis[0].constraint == "beyond 2 set-ups"
    assert outcome.refusal.diagnosis[0].waypoints
    assert any("leg" in blame.constraint and blame.shortfall > 0 for blame in outcome.refusal.diagnosis)
    assert {p.name for p in tmp_path.iterdir()} == {"plan.npz", "verdict.json", "manifest.json"}
    assert json.loads((tmp_path / "verdict.json").read_text())["refusal"]["cause"].startswith("2 set-ups are not")


@pytest.mark.parametrize("stage", ["setups", "leg_path", "write_json"])
def test_an_interruption_changes_nothing(stage, job, pieces, tmp_path, monkeypatch):
    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    home = next(each for each in (stages, attempt, task) if hasattr(each, stage))
    monkeypatch.setattr(home, stage, stop)
    with pytest.raises(KeyboardInterrupt):
        run(Job.load(job), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_one_fixed_placement_is_one_set_up(make_job):
    job = make_job(('mode = "fixed"', 'mode = "fixed"\nsetups = 2'))
    with pytest.raises(JobError, match="one fixed placement is one set-up"):
        Job.load(job)


def test_set_ups_are_not_searched_for_where_they_do_not_help(job, tmp_path, monkeypatch):
    monkeypatch.setattr(stages, "meets_wherever_it_stands", lambda *_: True)
    monkeypatch.setattr(stages, "setups", lambda *_: pytest.fail("a partition is searched for"))
    refusal = run(Job.load(job), tmp_path / "out", advice=None).refusal
    assert refusal.cause.startswith("set-ups do not help: above its tip the tool touches the part")
    assert json.loads((tmp_path / "out" / "verdict.json").read_text())["refusal"]["cause"] == refusal.cause


@pytest.mark.parametrize(
    ("limit", "waypoints", "tilt", "mode", "so"),
    [
        ("spindle touches the part", (14, 15), 0.0, "fixed", True),
        ("tool body touches the part", (14, 15), 0.0, "normal", True),
        ("spindle touches the part", (14, 15), 0.1, "normal", False),  # it leans elsewhere
        ("spindle touches the part", (14, 15), 0.0, "auto", False),  # towards another direction
        ("spindle touches the part", (5, 6), 0.0, "fixed", False),  # on a link, which pieces may not have
        ("spindle touches the part", (9, 10), 0.0, "fixed", False),  # a cut begins there
        ("spindle touches the table", (14, 15), 0.0, "fixed", False),
        ("leg 1 touches the part", (14, 15), 0.0, "fixed", False),
    ],
)
def test_the_tool_touches_the_part_wherever_that_stands(limit, waypoints, tilt, mode, so):
    x = np.linspace(0.0, 0.1, 11)
    line = np.column_stack([x, np.zeros((11, 2))])
    up = np.tile([0.0, 0.0, 1.0], (11, 1))
    kinds = (SegmentKind.LINK, SegmentKind.CUT)
    path = Toolpath(tuple(Segment(kind, line + 0.1 * k * np.eye(3)[0], up, 0.02) for k, kind in enumerate(kinds)), 0.0)
    planned = SimpleNamespace(
        specification=SimpleNamespace(tilt=tilt), job=SimpleNamespace(axis=SimpleNamespace(mode=mode)), toolpath=path
    )
    refusal = Refusal("placement", "it does not fit", (Shortfall(limit, (waypoints,), 1.0, "mm"),), "")
    assert stages.meets_wherever_it_stands(planned, refusal) == so
