"""The set-up sheet: written by the plan and read back from a folder, self-contained, true to the run; clear errors."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from html import unescape
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from pentapod.base.files import sha256_of
from pentapod.cli.commands.new import dome_stl
from pentapod.cli.main import run as command
from pentapod.job import Job, run
from pentapod.planning import PlacedPath
from pentapod.program import Program
from pentapod.report.drawings.planned_run import PlannedRun
from pentapod.report.drawings.touch_off import touch_off_points
from pentapod.report.drawings.views import setup_drawings
from pentapod.report.sheet import write_sheet
from pentapod.timing import Trajectory
from pentapod.toolpath import SegmentKind
from usual_job import job_text

LIBRARY = files("pentapod.machine.library")


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """The folder of a small job whose run is in `out`, with its sheet, and the outcome."""
    folder = tmp_path_factory.mktemp("sheet") / "bracket"
    folder.mkdir()
    (folder / "part.stl").write_bytes(dome_stl(cells=12))
    (folder / "desk.toml").write_text(LIBRARY.joinpath("desk.toml").read_text(encoding="utf-8"), encoding="utf-8")
    text = job_text().replace("diameter_mm = 10", "diameter_mm = 10\nflute_mm = 20")
    text = text.replace('unit = "mm"', 'unit = "mm"\nstock_mm = [70, 65, 20]')
    (folder / "job.toml").write_text(text.replace('name = "desk"', 'file = "desk.toml"'))
    outcome = run(Job.load(folder / "job.toml"), folder / "out", writers={"sheet.html": write_sheet})
    return folder, outcome


@pytest.fixture(scope="module")
def sheet(planned):
    return (planned[0] / "out" / "sheet.html").read_text(encoding="utf-8")


@pytest.fixture
def copied(planned, tmp_path):
    shutil.copytree(planned[0], tmp_path / "bracket")
    return tmp_path / "bracket"


def told(text: str) -> str:
    """The text of a page, with its minus signs plain."""
    return " ".join(unescape(re.sub(r"<[^>]+>", " ", text)).replace("−", "-").split())


def test_sheet_tells_the_stock_and_which_side_is_up(sheet):
    page = told(sheet)
    assert "stock 70.0 × 65.0 × 20.0 along X, Y, Z" in page, page[page.index("part.stl") - 20 :][:300]
    assert "up +Z of the mesh" in page


def test_a_stock_that_is_smaller_than_the_part_is_refused(planned, copied, capsys):
    job = Job.load(planned[0] / "job.toml")
    assert job.digest == job.with_(**{"part.stock_mm": None}).digest, "the program does not depend on it"
    file = copied / "job.toml"
    file.write_text(file.read_text(encoding="utf-8").replace("[70, 65, 20]", "[70, 55, 20]"), encoding="utf-8")
    assert command(["plan", str(file), "-o", str(copied / "again")]) == 2
    assert "part.stock_mm: the stock is smaller than the part" in capsys.readouterr().err


def test_sheet_needs_no_script_and_no_request(sheet):
    assert "default-src 'none'" in sheet
    assert "<script" not in sheet
    assert not re.search(r"(?:src|href)=|url\(|@import| on\w+=", sheet)
    assert len(sheet) < 200_000


def test_sheet_tells_tool_part_poses_and_program(planned, sheet):
    folder, outcome = planned
    program, placed, machine = outcome.find(Program), outcome.find(PlacedPath), outcome.machine
    words = told(sheet)
    for leg_row in (program.legs[0], program.legs[-1]):
        assert ", ".join(f"{1e3 * leg:.3f}" for leg in leg_row) in words
    x, y, z = 1e3 * placed.placement.transform.translation
    assert f"x {x:.2f}, y {y:.2f}, z {z:.2f}".replace("-0.00", "0.00") in words
    assert "ball tool, diameter 10 mm, flute 20 mm" in words
    assert f"{1e3 * machine.bodies.shaft_end:g}, spindle's nose to tip" in words
    assert "stem not given: ⌀ 10 assumed" in words
    assert sha256_of(folder / "out" / "program.csv")[:12] in words
    assert machine.digest in words
    assert "Verdict: passed" in words
    assert words.count("touch-off") >= 3
    assert len(re.findall('type="checkbox"', sheet)) >= 7


def test_a_run_and_its_drawings_are_remembered_with_all_that_they_show(planned):
    _, outcome = planned
    shown = PlannedRun.of(outcome)
    assert PlannedRun.of(outcome) is shown
    slower = replace(outcome, job=outcome.job.with_(feed={"cut_mm_min": 700}))
    assert PlannedRun.of(slower).job.feed.cut_mm_min == 700
    points = touch_off_points(shown)
    assert setup_drawings(shown, points) is setup_drawings(shown, points)
    assert setup_drawings(shown, points[:1]) != setup_drawings(shown, points)


def test_sheet_times_add_up_to_the_program(planned):
    """Times of segments by the tip's way, against the time law's own segments."""
    _, outcome = planned
    shown, law, program = PlannedRun.of(outcome), outcome.find(Trajectory), outcome.find(Program)
    times = shown.segment_times
    assert times.sum() == pytest.approx(program.duration, abs=1e-9)
    at = np.arange(0.0, law.duration, 1e-3)
    counted = np.bincount(law.segment(at), minlength=len(times)) * 1e-3
    cuts = np.array([s.kind is SegmentKind.CUT for s in shown.toolpath.segments])
    assert times[cuts].sum() == pytest.approx(counted[cuts].sum(), abs=0.01 * program.duration)
    assert times == pytest.approx(counted, abs=0.1)


def test_sheet_command_writes_the_sheet_of_the_plan(planned, sheet, tmp_path, capsys):
    folder, _ = planned
    assert command(["sheet", str(folder / "out"), "-o", str(tmp_path / "again.html")]) == 0
    assert "again.html" in capsys.readouterr().out
    assert told((tmp_path / "again.html").read_text(encoding="utf-8")) == told(sheet)


def test_a_sheet_that_is_written_anew_belongs_to_the_run(copied, sheet, monkeypatch):
    """A later version may write another one: the run stays whole, and is read again."""
    monkeypatch.setattr("pentapod.report.sheet.page.sheet_html", lambda pages: f"<p>{len(pages)} page, as of later</p>")
    assert command(["sheet", str(copied / "out")]) == 0
    assert (copied / "out" / "sheet.html").read_text(encoding="utf-8") == "<p>1 page, as of later</p>"
    monkeypatch.undo()
    assert command(["sheet", str(copied / "out")]) == 0
    assert told((copied / "out" / "sheet.html").read_text(encoding="utf-8")) == told(sheet)


def refused(capsys, *arguments: str | Path) -> str:
    """The one line by which a command refuses its arguments."""
    assert command(["sheet", *map(str, arguments)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    return said.err


def test_sheet_of_no_run_is_an_error(capsys, tmp_path):
    assert "no such folder" in refused(capsys, tmp_path / "none")
    assert "there is no run in this folder" in refused(capsys, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_sheet_of_a_changed_job_part_or_machine_is_an_error(copied, capsys):
    job, part, out = copied / "job.toml", copied / "part.stl", copied / "out"
    text = job.read_text()
    job.write_text(text.replace("cut_mm_min = 3000", "cut_mm_min = 2000"))
    assert "changed since this run" in refused(capsys, out)
    job.write_text(text)
    mesh = part.read_bytes()
    part.write_bytes(dome_stl(cells=13))
    assert "changed since this run" in refused(capsys, out)
    part.write_bytes(mesh)
    machine = copied / "desk.toml"
    machine.write_text(machine.read_text().replace("max_velocity_mm_s = 500", "max_velocity_mm_s = 501"))
    assert "changed since this run" in refused(capsys, out)
    machine.write_text(machine.read_text().replace("max_velocity_mm_s = 501", "max_velocity_mm_s = 500"))
    assert command(["sheet", str(out)]) == 0
    capsys.readouterr()
    program = out / "program.csv"  # a shipped machine may have been another one in the version that planned
    program.write_text(re.sub(r'machine_digest = "\w+"', f'machine_digest = "{"0" * 16}"', program.read_text()))
    assert "different runs" in refused(capsys, out)
    (out / "manifest.json").unlink()
    assert "not the one that the program was made for" in refused(capsys, out)
    job.unlink()
    assert "--job" in refused(capsys, out)


def test_sheet_of_a_refused_or_withheld_run_is_an_error(copied, capsys, make_job, tmp_path):
    outcome = run(
        Job.load(make_job(("position_mm = [", "position_mm = [1000.0, 0, 700] # ["))), tmp_path / "refused",
        writers={"sheet.html": write_sheet}, advice=None,
    )  # fmt: skip
    assert outcome.refusal is not None
    assert not (tmp_path / "refused" / "sheet.html").exists()
    assert "the job was refused" in refused(capsys, tmp_path / "refused")
    (copied / "out" / "program.csv").rename(copied / "out" / "withheld.csv")
    (copied / "out" / "manifest.json").unlink()
    assert "fails its own verdict" in refused(capsys, copied / "out")
