"""The server: its page is the report's, margins follow the part, and it plans again; no browser is needed."""

from __future__ import annotations

import csv
import dataclasses
import http.client
import io
import json
import re
import shutil
import signal
import subprocess
import sys
import time
import urllib.request
from contextlib import closing
from html import unescape

import numpy as np
import pytest
from asked import PATIENCE_S, address, ask, at, page_of, planned_there, shifted
from scipy.spatial.transform import Rotation

from page_arrays import page_arrays, page_data
from pentapod.base.errors import InputError
from pentapod.cli.main import run as command
from pentapod.geometry import RigidTransform
from pentapod.job import Job, run
from pentapod.job.build.placement import job_at, placement_toml
from pentapod.machine import Machine
from pentapod.machine.leg_ends import leg_ends
from pentapod.program import Program
from pentapod.report import write_report
from pentapod.report.page.keys import joints_beside
from pentapod.timing import Trajectory
from pentapod.view import Study, Viewer, open_run
from pentapod.view.viewed import ViewedRun, numbers_of, placement_of

TOO_FAR = ("position_mm = [", "position_mm = [1000.0, 0, 700] # [")


@pytest.fixture(scope="module")
def viewer(opened):
    """For tests that change nothing."""
    with Viewer(opened, port=18100) as viewer:
        yield viewer


@pytest.fixture
def own(planned, tmp_path):
    """With a run of its own, which may be planned again."""
    shutil.copytree(planned[0], tmp_path / "job")
    with Viewer(open_run(tmp_path / "job" / "out"), port=18150) as viewer:
        yield viewer


def test_the_page_is_the_reports_with_a_run_read_back(viewer, planned, tmp_path):
    """Motion, plots and claims from the folder are those of the outcome."""
    text, _ = page_of(viewer)
    report = write_report(planned[1], tmp_path / "report.html").read_text(encoding="utf-8")
    shown, reported = page_arrays(text), page_arrays(report)
    assert set(shown) - set(reported) == {"live.points"}
    assert set(reported) <= set(shown)
    for name, values in reported.items():
        if not name.startswith(("key.", "plot.4")):  # keys and feeds change with segments, which are known to a row
            assert np.array_equal(shown[name], values, equal_nan=True), name
    times = np.linspace(0.0, planned[1].find(Program).duration, 2001)
    for name, most in (("key.tip", 0.03), ("key.axis", 1e-3)):
        here, there = (
            np.column_stack([np.interp(times, page["key.time"][:, 0], column) for column in page[name].T])
            for page in (shown, reported)
        )
        assert np.abs(here - there).max() < most
    data = page_data(text)
    shown, reported = data["motion"], page_data(report)["motion"]
    for here, there in zip(shown.pop("kinds"), reported.pop("kinds"), strict=True):  # the former counts rows
        assert (here["name"], here["colour"]) == (there["name"], there["colour"])
        assert here["seconds"] == pytest.approx(there["seconds"], rel=0.05, abs=0.2)
    assert shown == reported
    assert {"live", "scene", "plots"} <= set(data)
    for claim in planned[1].verdict.certificates:
        assert claim.claim in unescape(text)
    limits = [re.findall(r"All limits on the motion</summary>.*?</details>", page, re.S) for page in (text, report)]
    assert len(limits[1]) == 1
    assert limits[0] == limits[1], "what a change of a limit would save, too"


def test_segments_of_the_time_law_are_read_back(planned, viewer):
    law, made = viewer.runs[0].viewed.law, planned[1].find(Trajectory)
    times = np.linspace(0.0, made.duration, 5001)
    assert law.duration == pytest.approx(made.duration)
    segments = made.segment(times)
    changes = times[np.flatnonzero(np.diff(segments))]
    other = times[law.segment(times) != segments]
    assert len(changes) > 5
    assert np.abs(other[:, None] - changes).min(axis=1).max(initial=0.0) < 0.02, "only near the changes"


def test_margins_follow_the_part(viewer, opened):
    here = ask(viewer, "margins", at(opened.placement, thorough=True))
    study = Study.of(opened)
    reach = study.at(opened.placement, thorough=True)
    assert here["fits"]
    assert here["text"].startswith("Fits. Smallest margin")
    assert reach.worst.limit in here["text"]
    assert here["step"] * np.array(here["margins"]) == pytest.approx(reach.margins[study.shown], abs=here["step"])
    away = shifted(opened.placement, 0.5, 0.0, 0.0)
    for thorough in (False, True):
        there, wanted = ask(viewer, "margins", at(away, thorough=thorough)), study.at(away, thorough=thorough)
        assert not there["fits"]
        assert there["text"].startswith(f"Does not fit at {100.0 * wanted.beyond:.1f} % of the path.")
        assert len(there["margins"]) == len(study.shown)
        assert min(there["margins"]) < 0
    leaning = ask(viewer, "margins", at(away, tilted=True, thorough=True))
    assert sum(leaning["margins"]) > sum(there["margins"])


def test_a_dragged_placement_is_answered_at_once(viewer, opened):
    """The small job's; on the demo it takes 17 ms on an idle machine. A busy one is no failure: the best of ten."""
    lasted = []
    with closing(http.client.HTTPConnection(address(viewer)[0], timeout=PATIENCE_S)) as connection:
        for step in range(10):
            begun = time.perf_counter()
            there = shifted(opened.placement, 1e-3 * step, 0.0, 0.0)
            assert ask(viewer, "margins", at(there), connection=connection)["margins"]
            lasted.append(time.perf_counter() - begun)
    assert min(lasted) < 0.05


def test_placements_go_to_the_page_and_back(opened):
    again = placement_of(numbers_of(opened.placement))
    assert again.rotation == pytest.approx(opened.placement.rotation, abs=1e-15)
    assert again.translation == pytest.approx(opened.placement.translation, abs=1e-15)


def test_touch_off_points_of_a_placement(viewer, opened):
    """The tool there is where the forward kinematics puts it, and the points are the report's, moved with the part."""
    placement = shifted(opened.placement, 0.01, -0.02, 0.005)
    found = ask(viewer, "touch-off", at(placement))
    assert found["name"] == f"{opened.folder.parent.name}-touch-off.csv"
    rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(io.StringIO(found["text"]))]
    assert len(rows) == 3
    machine = opened.machine
    for row in rows:
        mesh, there, tip, axis = (
            np.array([row[f"{k}_{a}"] for a in "xyz"]) for k in ("mesh", "machine", "tip", "axis")
        )
        assert placement.apply(1e-3 * mesh) == pytest.approx(1e-3 * there, abs=2e-8)
        legs = 1e-3 * np.array([row[f"leg_{leg + 1}"] for leg in range(machine.robot.n_legs)])
        position, direction = machine.robot.pose(legs, opened.component)
        assert position + machine.tool_length * direction == pytest.approx(1e-3 * tip, abs=1e-6)
        assert -direction == pytest.approx(axis, abs=1e-5)


def test_a_placement_file_is_read(viewer, opened):
    placement = shifted(opened.placement, 0.01, 0.0, 0.0)
    text = placement_toml(job_at(opened.job, placement).placement)
    there = ask(viewer, "placement", {"text": text, "name": "found.toml"})["placement"]
    assert placement_of(there).matrix == pytest.approx(placement.matrix, abs=1e-8)
    for wrong, said in (
        ("x = 1", "found.toml.*placement"),
        ("[", "found.toml"),
        ('[placement]\nmode = "free"', "fixed"),
    ):
        error = ask(viewer, "placement", {"text": wrong, "name": "found.toml"}, expected=400)["error"]
        assert re.search(said, error), error
    ask(viewer, "placement", {"text": 3, "name": "found.toml"}, expected=400)


def test_viewer_plans_again_where_the_part_is(own):
    wanted = shifted(own.runs[0].viewed.opened.placement, 0.012, -0.007, 0.004)
    before = own.runs[0].viewed
    news, stages = planned_there(own, wanted)
    after = own.runs[0].viewed
    assert news["passed"]
    assert news["isNew"]
    assert "Verdict: passed" in news["text"]
    assert {stage for stage, _ in stages}, "its progress was told"
    assert all(0.0 <= share <= 1.0 for _, share in stages)
    assert after is not before
    assert after.opened.placement.translation == pytest.approx(wanted.translation, abs=1e-8)
    assert page_data(page_of(own)[0])["live"]["placement"] == pytest.approx(numbers_of(wanted), abs=1e-5)
    # With the table that is shown the job is the program's job.
    job, folder = after.opened.job.path, after.opened.folder
    assert {"report.html", "sheet.html", "program.csv"} <= {path.name for path in folder.iterdir()}
    text = job.read_text(encoding="utf-8")
    job.write_text(text.split("[placement]")[0] + news["toml"] + "\n", encoding="utf-8")
    assert command(["verify", str(folder / "program.csv"), "--job", str(job), "--quiet"]) == 0
    assert Job.load(job).digest == after.opened.program.provenance.job_digest


@pytest.mark.slow  # in the fast lane: advice of the command, tests/job/advice
def test_a_refusal_is_told_with_its_advice(own):
    before = own.runs[0].viewed
    news, _ = planned_there(own, shifted(before.opened.placement, 1.0, 0.0, 0.0))
    assert not news["passed"]
    assert not news["isNew"]
    assert news["text"].startswith("Refused. placement: the part does not fit")
    assert ("This change of the job was planned" in news["text"]) == bool(news["toml"])
    assert news["toml"], "the part elsewhere is planned"
    assert own.runs[0].viewed is before


def test_planning_can_be_cancelled(own):
    before = own.runs[0].viewed
    state = ask(own, "plan", at(shifted(before.opened.placement, 0.01, 0.0, 0.0)))
    assert state["plans"]
    assert ask(own, "plan", at(before.opened.placement))["plans"], "one plan at a time"
    assert ask(own, "cancel")["ends"]
    end = time.monotonic() + PATIENCE_S
    while (state := ask(own, "state"))["plans"]:
        assert time.monotonic() < end
        time.sleep(0.02)
    assert state["news"]["text"].startswith("Cancelled")
    assert not state["ends"]
    assert own.runs[0].viewed is before
    assert not (before.opened.folder / "replanned").exists()


def test_a_refused_job_is_shown_with_a_motion_at_its_feeds(make_job, tmp_path):
    outcome = run(Job.load(make_job(TOO_FAR)), tmp_path / "out", advice=None)
    shown = ViewedRun.of(open_run(tmp_path / "out"))
    assert shown.outcome.refusal.cause == outcome.refusal.cause
    assert shown.outcome.refusal.diagnosis == outcome.refusal.diagnosis
    text = shown.page("token", "/1")
    arrays, data = page_arrays(text), page_data(text)
    toolpath, machine, seconds = shown.opened.toolpath, shown.machine, 0.0
    for segment in toolpath.segments:
        way = sum(float(np.linalg.norm(b - a)) for a, b in zip(segment.tips, segment.tips[1:], strict=False))
        seconds += way / min(segment.feed, machine.rapid_velocity)
    assert arrays["key.time"][-1, 0] == pytest.approx(seconds, rel=1e-3)
    assert (np.diff(arrays["key.time"][:, 0]) >= 0.0).all()
    assert 1e-3 * arrays["key.tip"] == pytest.approx(shown.opened.placement.apply(toolpath.tips), abs=1e-5)
    assert data["plots"] is None
    assert "This job cannot be done" in text
    assert 'id="play"' in text
    assert "There is no program" in text


@pytest.mark.parametrize("name", ["hexa", "spr", "prpu"])
def test_joints_beside_the_tool_axis_are_where_the_part_is(opened, name):
    """Machines with arms: at the dragged part, not carried there with it."""
    machine = Machine.load(name)
    run = ViewedRun(ViewedRun.of(opened).outcome, dataclasses.replace(opened, program=None))
    stages = tuple(stage for stage in run.outcome.stages if not isinstance(stage.value, Program))
    run = ViewedRun(dataclasses.replace(run.outcome, machine=machine, stages=stages), run.opened)
    tips, axes = run.placed.tips, run.placed.axes
    beside = joints_beside(machine, tips[0], axes[0])
    turn = Rotation.from_rotvec([0.0, 0.0, 0.2]).as_matrix()
    moved = RigidTransform(turn, np.array([0.01, -0.005, 0.0]))
    expected = leg_ends(machine, moved.apply(tips), moved.rotate(axes))[1][:, beside]
    carried = moved.apply(leg_ends(machine, tips, axes)[1][:, beside])
    assert len(beside)
    found = np.array(run.joints_mm(moved @ opened.placement))
    assert found == pytest.approx(1e3 * expected.ravel(), abs=1e-3)
    assert np.abs(found - 1e3 * carried.ravel()).max() > 1e-2


def test_two_runs_are_compared(planned, opened, tmp_path):
    shutil.copytree(planned[0], tmp_path / "job")
    job = tmp_path / "job" / "job.toml"
    job.write_text(job.read_text().replace("cut_mm_min = 3000", "cut_mm_min = 2000"))
    slower = run(Job.load(job), tmp_path / "slower")
    with Viewer(opened, open_run(tmp_path / "slower", job), port=18170) as both:
        text, _ = page_of(both)
        rows = unescape(text)
        assert page_data(text)["compare"] is True
        for outcome in (planned[1], slower):
            assert f"<td>{outcome.find(Program).duration:.3g} s</td>" in rows
            assert "<td>✓ passed</td>" in rows
        for number in (1, 2):
            assert f'src="/{number}?token={address(both)[1]}"' in rows
            assert page_data(page_of(both, f"/{number}")[0])["live"]["base"] == f"/{number}"
        for claim in slower.verdict.certificates:
            assert f"<td>{claim.claim}</td>" in rows
        away = at(shifted(opened.placement, 0.5, 0.0, 0.0))
        assert not ask(both, "margins", away, number=2)["fits"]


def test_a_broken_verdict_is_an_error(planned, tmp_path):
    shutil.copytree(planned[0], tmp_path / "job")
    verdict = tmp_path / "job" / "out" / "verdict.json"
    (tmp_path / "job" / "out" / "manifest.json").unlink()
    for text in ("{", '{"certificates": [{"claim": 1}]}', '{"certificates": 3}'):
        verdict.write_text(text)
        with pytest.raises(InputError, match=r"verdict\.json: .*broken"):
            ViewedRun.of(open_run(tmp_path / "job" / "out"))
    verdict.unlink()
    assert "not judged" in ViewedRun.of(open_run(tmp_path / "job" / "out")).outcome.verdict.answer


def test_the_next_free_port_is_taken(viewer, opened):
    with Viewer(opened, port=18100) as second:
        assert address(second)[0] != address(viewer)[0]
    with pytest.raises(InputError, match=r"host.*192\.0\.2\.1.*an address of this machine"):
        Viewer(opened, host="192.0.2.1", port=18100)


def test_the_command_serves_until_it_is_interrupted(planned):
    run_command = "from pentapod.cli.main import main; main()"
    arguments = ["view", str(planned[0] / "out"), "--no-open", "--json", "--port", "18200"]
    with subprocess.Popen(
        [sys.executable, "-c", run_command, *arguments], stdout=subprocess.PIPE, text=True
    ) as serving:
        try:
            said = ""
            while "}" not in said:
                line = serving.stdout.readline()
                assert line, "it ended by itself"
                said += line
            with urllib.request.urlopen(json.loads(said)["url"], timeout=PATIENCE_S) as page:
                assert page.status == 200
                assert b'<canvas id="canvas"' in page.read()
            serving.send_signal(signal.SIGINT)
            assert serving.wait(PATIENCE_S) == 0
        finally:
            serving.kill()
