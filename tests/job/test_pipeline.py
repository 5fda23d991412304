"""From a job to its artefacts: what is written, when, and what is never left behind."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from pentapod.base.errors import InputError, JobError, MeshError, ToolpathError
from pentapod.base.refusal import Refusal
from pentapod.geometry import RigidTransform
from pentapod.job import Job, judge, run, task
from pentapod.job.artefacts import check_folder
from pentapod.job.build.placement import job_constraints
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.job.outcome import SetUps
from pentapod.job.pipeline import attempt
from pentapod.job.pipeline import run as pipeline
from pentapod.job.run_folder import staged
from pentapod.job.schema.strategies import job_strategies
from pentapod.planning import LegPath, PlacedPath
from pentapod.program import read_csv
from pentapod.timing import Explanation, Trajectory
from pentapod.toolpath import SegmentKind, Toolpath

TOOLPATHS = Path(__file__).parents[2] / "toolpaths"
SHIPPED = sorted(path.stem for path in TOOLPATHS.glob("*.toml"))
WHOLE = {"program.csv", "plan.npz", "verdict.json", "manifest.json"}
TOO_FAR = ("position_mm = [", "position_mm = [1000.0, 0, 700] # [")


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_the_shipped_jobs_show_every_strategy():
    assert len(SHIPPED) >= 12
    shown = {Job.load(TOOLPATHS / f"{name}.toml").toolpath.strategy for name in SHIPPED}
    assert shown | {"file"} == set(job_strategies())


LONG = ("oversize", "spiral", "offset", "wavy", "waterline", "rail", "dome", "polish", "saddle", "hatch")
"""Shipped jobs whose toolpaths take long; their strategies have quick tests of their own."""


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow) if n in LONG else n for n in SHIPPED])
def test_toolpaths_of_shipped_jobs(name):
    job = Job.load(TOOLPATHS / f"{name}.toml")
    toolpath, report = job_toolpath(job, job_mesh(job))
    assert any(segment.kind is SegmentKind.CUT for segment in toolpath.segments)
    assert "problem" not in str(report)


def check_shipped(job, folder):
    outcome = run(job, folder, advice=None)
    name = job.path.stem
    assert outcome.passed is (name != "oversize"), outcome.refusal or [
        c for c in outcome.verdict.certificates if not c.passed
    ]
    if name == "oversize":
        refusal = outcome.refusal
        assert refusal is not None
        assert refusal.stage == "placement"
        assert any("too long" in blame.constraint for blame in refusal.diagnosis)
        assert all(blame.shortfall > 0 and blame.waypoints for blame in refusal.diagnosis)
        assert names(folder) == WHOLE - {"program.csv"}
    elif name == "rail":
        setups = outcome.find(SetUps)
        assert setups is not None
        assert len(setups.parts) == 2
        assert all(names(folder / part.folder) == WHOLE for part in setups.parts)
    else:
        assert names(folder) == WHOLE
        assert len(outcome.verdict.certificates) > 15


@pytest.mark.slow  # in the fast lane: make demo plans the dome
@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_jobs(name, tmp_path):
    check_shipped(Job.load(TOOLPATHS / f"{name}.toml"), tmp_path)


@pytest.mark.slow  # in the fast lane: refusals of smaller jobs
def test_the_oversize_job_with_fewer_waypoints(tmp_path):
    shutil.copytree(TOOLPATHS, tmp_path / "toolpaths")
    path = tmp_path / "toolpaths" / "oversize.toml"
    text = path.read_text(encoding="utf-8")
    for old, new in (("stepover_mm = 10", "stepover_mm = 80"), ("spacing_mm = 5", "spacing_mm = 30")):
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    check_shipped(Job.load(path), tmp_path / "out")


def test_artefacts_agree_with_each_other(usual_run):
    _, out, outcome = usual_run
    assert outcome.passed
    assert names(out) == WHOLE
    program = read_csv(out / "program.csv")
    assert program.provenance.job_digest == outcome.job.digest
    verdict = json.loads((out / "verdict.json").read_text())
    assert verdict == outcome.to_dict()
    assert verdict["passed"] is True
    assert set(verdict["certificates"][0]) == {
        "claim", "passed", "value", "bound", "unit", "where", "method", "allowed", "at_least"
    }  # fmt: skip
    with np.load(out / "plan.npz") as arrays:
        assert np.array_equal(arrays["program.legs_mm"], program.legs * 1e3)
        count = len(arrays["toolpath.tips_mm"])
        assert arrays["placed.margins"].shape == (count, len(arrays["placed.margin_names"]))
        placed = outcome.find(PlacedPath)
        assert placed is not None
        moved = placed.placement.transform.apply(arrays["toolpath.tips_mm"] * 1e-3)
        assert np.allclose(arrays["placed.tips_mm"] * 1e-3, moved)  # no tilt: the tips only move with the part
        assert np.isfinite(arrays["leg_path.legs_mm"]).all()
        assert (np.diff(arrays["trajectory.time_s"]) >= 0).all()
    assert [stage.name for stage in outcome.stages] == [
        "mesh", "toolpath", "placement", "leg path", "timing", "program", "explain", "verify",
    ]  # fmt: skip
    assert all(stage.seconds >= 0 for stage in outcome.stages)


@pytest.mark.slow  # in the fast lane: test_determinism.py
def test_two_runs_give_the_same_bytes(make_job, tmp_path):
    job = Job.load(make_job(("tilt_deg = 0", "tilt_deg = 10")))
    run(job, tmp_path / "a")
    run(job, tmp_path / "b")
    assert contents(tmp_path / "a") == contents(tmp_path / "b")


@pytest.mark.slow  # in the fast lane: test_determinism.py
def test_free_placement_gives_the_same_bytes_twice(make_job, tmp_path):
    text = make_job().read_text().split("[placement]")[0].replace("tilt_deg = 0", "tilt_deg = 12")
    path = tmp_path / "free.toml"
    path.write_text(text)
    for name in ("a", "b"):
        assert run(Job.load(path), tmp_path / name).passed
    assert contents(tmp_path / "a") == contents(tmp_path / "b")


def test_a_refused_job_leaves_no_program_not_even_an_old_one(usual_run, make_job, tmp_path):
    out = shutil.copytree(usual_run[1], tmp_path / "out")
    (out / "notes.txt").write_text("mine")
    outcome = run(Job.load(make_job(TOO_FAR)), out, advice=None)
    assert isinstance(outcome.refusal, Refusal)
    assert not outcome.passed
    assert names(out) == {"plan.npz", "verdict.json", "manifest.json", "notes.txt"}
    verdict = json.loads((out / "verdict.json").read_text())
    assert verdict["passed"] is False
    assert verdict["refusal"]["cause"]
    assert verdict["refusal"]["diagnosis"][0]["shortfall"] > 0
    assert all(c["passed"] is False for c in verdict["certificates"])


def test_a_second_run_on_the_folder_is_told_before_any_work(make_job, tmp_path):
    stages = []
    with staged(tmp_path / "out"), pytest.raises(InputError, match="another run is writing into this folder"):
        run(Job.load(make_job()), tmp_path / "out", lambda stage, *_: stages.append(stage))
    assert stages == []


SLOW_STAGES = ["sample", "judged", "write_arrays"]


@pytest.mark.parametrize(
    ("stage", "error"),
    [
        *((stage, KeyboardInterrupt) for stage in ("plan", "leg_path", "retime", "write_json")),
        *(pytest.param(stage, KeyboardInterrupt, marks=pytest.mark.slow) for stage in SLOW_STAGES),
        ("leg_path", RuntimeError),
    ],
)
def test_interrupted_runs_change_nothing(stage, error, usual_run, tmp_path, monkeypatch):
    job, old, fresh = usual_run[0], tmp_path / "old", tmp_path / "deep" / "fresh"
    shutil.copytree(usual_run[1], old)
    before = contents(old)

    def stop(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(attempt if hasattr(attempt, stage) else task, stage, stop)
    for folder in (old, fresh):
        with pytest.raises(error):
            run(job, folder)
    assert contents(old) == before
    assert not fresh.exists()


def test_bad_mesh_changes_nothing(usual_run, make_job, tmp_path):
    out = shutil.copytree(usual_run[1], tmp_path / "out")
    before = contents(out)
    with pytest.raises(MeshError):
        run(Job.load(make_job(mesh=b"solid text, not a mesh\n")), out)
    assert contents(out) == before


def test_folder_that_cannot_be_written(make_job, tmp_path, monkeypatch):
    job = Job.load(make_job())
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(pipeline, "job_mesh", lambda _: pytest.fail("checked before the work starts"))
    for folder in (tmp_path / "file", tmp_path / "file" / "below", Path("/proc/nothing/here")):
        with pytest.raises(InputError, match="cannot be written"):
            run(job, folder)
    check_folder(tmp_path / "not" / "yet")
    assert not (tmp_path / "not").exists()


def test_tolerances_and_units_are_checked_against_the_mesh(make_job):
    for old, new in (("path_mm = 0.05", "path_mm = 50"), ("[tolerance]", "[tolerance]\nchordal_mm = 7")):
        with pytest.raises(JobError, match="too large for the part") as caught:
            job_mesh(Job.load(make_job((old, new))))
        assert "60 mm" in str(caught.value)
    with pytest.raises(JobError, match="unit of the mesh is missing") as caught:
        job_mesh(Job.load(make_job(('unit = "mm"\n', ""))))
    assert "part.unit" in str(caught.value)
    assert "likely" in str(caught.value)


def test_nothing_to_machine_is_bad_input(make_job):
    job = Job.load(make_job(('unit = "mm"', 'unit = "mm"\nregion_direction = [0, 0, -1]')))
    with pytest.raises(ToolpathError):
        job_toolpath(job, job_mesh(job))


def placement_of(job: Path) -> RigidTransform:
    loaded = Job.load(job)
    (pose,) = job_constraints(loaded, job_machine(loaded), job_mesh(loaded)).poses
    return pose


def test_placements_in_both_spellings_are_one(make_job):
    angles = placement_of(make_job(("[180, 0, 0]", "[170, 20, 30]")))
    rows = angles.matrix.copy()
    rows[:3, 3] *= 1e3
    text = make_job().read_text()
    position = next(line for line in text.splitlines() if line.startswith("position_mm"))
    matrix = placement_of(make_job((position, f"matrix = {rows.tolist()}"), ("rotation_deg = [180, 0, 0]\n", "")))
    assert np.allclose(matrix.matrix, angles.matrix, atol=1e-15)
    rows[0, 0] += 0.1
    with pytest.raises(JobError, match=r"placement\.matrix"):
        placement_of(make_job((position, f"matrix = {rows.tolist()}"), ("rotation_deg = [180, 0, 0]\n", "")))


def test_rotation_turns_about_fixed_axes_x_first(make_job):
    placement = placement_of(make_job(("[180, 0, 0]", "[90, 0, 90]")))
    # y turns about x to z, which a turn about z leaves; x turns about z to y.
    assert np.allclose(placement.rotate([0, 1, 0]), [0, 0, 1])
    assert np.allclose(placement.rotate([1, 0, 0]), [0, 1, 0])


@pytest.mark.parametrize(("period", "interpolation"), [pytest.param(2, "cubic", marks=pytest.mark.slow), (1, "linear")])
def test_output_settings_reach_the_program(period, interpolation, make_job, tmp_path):
    output = f'[output]\nperiod_ms = {period}\ninterpolation = "{interpolation}"\n\n[placement]'
    outcome = run(Job.load(make_job(("[placement]", output))), tmp_path / "out")
    assert outcome.passed, [c for c in outcome.verdict.certificates if not c.passed]
    program = read_csv(tmp_path / "out" / "program.csv")
    assert (program.period, program.interpolation) == (period * 1e-3, interpolation)


def test_a_job_may_limit_the_tool(make_job, tmp_path):
    keys = "cut_mm_min = 3000\nmax_tip_acceleration_mm_s2 = 800\nmax_tip_jerk_mm_s3 = 60000\n"
    keys += "max_axis_acceleration_deg_s2 = 600"
    outcome = run(Job.load(make_job(("cut_mm_min = 3000", keys))), tmp_path / "out")
    found = {c.claim: c for c in outcome.verdict.certificates}
    assert outcome.passed, [c for c in found.values() if not c.passed]
    assert found["tip acceleration"].bound == 800.0
    assert 0.9 * 800.0 < found["tip acceleration"].value <= 800.0
    assert {"tip jerk", "axis acceleration"} <= set(found)
    assert "axis velocity" not in found
    assert "tip acceleration" in str(outcome.find(Explanation))


def test_a_dwell_after_each_cut_by_job_key(usual_run, make_job, tmp_path):
    """The verdict judges it from the file; a program for the same job without the key fails that claim."""
    job = Job.load(make_job(("cut_mm_min = 3000", "cut_mm_min = 3000\ndwell_s = 0.25")))
    outcome = run(job, tmp_path / "dwell")
    assert outcome.passed
    toolpath = outcome.find(Toolpath)
    count = sum(seconds == 0.25 for seconds in toolpath.dwells)
    assert count >= 1
    claims = {c.claim: c for c in outcome.verdict.certificates}
    assert claims["dwells"].passed
    assert claims["dwells"].value == pytest.approx(0.25, abs=0.02)
    assert claims["exact stops"].passed
    assert outcome.find(Trajectory).duration - usual_run[2].find(Trajectory).duration > 0.25 * count
    judged = judge(job, usual_run[1] / "program.csv")
    assert not {c.claim: c for c in judged.certificates}["dwells"].passed


def test_exact_stops_at_corners_by_job_key(usual_run, make_job, tmp_path):
    """The default is 135 degrees."""
    job = Job.load(make_job(("cut_mm_min = 3000", "cut_mm_min = 3000\nstop_angle_deg = 60")))
    assert len(run(job, tmp_path).find(LegPath).pieces) > len(usual_run[2].find(LegPath).pieces)
