"""Tool axes that lean into the part: found before a program is written, and planned without leaning."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import toolpath_surfaces as surfaces
from pentapod.base.refusal import Shortfall
from pentapod.cli.commands.new import dome_stl
from pentapod.geometry import RigidTransform
from pentapod.job import Job, run, task
from pentapod.job.build.placed_check import meetings
from pentapod.job.mending import Mend
from pentapod.kinematics.component import COMPONENTS
from pentapod.planning import PlacedPath, Placement, plan
from pentapod.planning.placement.placed_path import UnplacedPath
from pentapod.toolpath import BallCutter, Mesh, RasterOptions, make_toolpath
from pentapod.verify import Cutting
from usual_job import job_text

TOO_FAR = np.radians(100.0)


def leaned(placed: PlacedPath, angle: float) -> PlacedPath:
    """The same path with all axes leaned by an angle about the balls' centres."""
    across = np.cross(placed.axes, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    axes = np.cos(angle) * placed.axes + np.sin(angle) * across
    tips = placed.tilt_centres - placed.toolpath.tilt_centre * axes
    return replace(placed, tips=tips, axes=axes)


def test_meetings_are_where_a_leaning_stem_is_in_the_part():
    mesh = Mesh.of(*surfaces.grid(lambda x, y: -3.0 * (x**2 + y**2), width=0.05, cells=12))
    tool = BallCutter(3e-3).with_stem(0.06)
    path = make_toolpath(mesh, tool, RasterOptions(stepover=8e-3))
    there = RigidTransform(np.diag([1.0, -1.0, -1.0]), np.array([0.1, 0.2, 0.5]))
    tips, axes = there.apply(path.tips), there.rotate(path.axes)
    placed = PlacedPath(path, Placement(there, "test"), COMPONENTS[0], tips, axes, np.ones((len(path), 1)), ())
    cutting = Cutting.of(mesh, tool)
    assert meetings(placed, cutting, 2e-5) == ()
    assert meetings(leaned(placed, np.radians(30.0)), cutting, 2e-5) == ()
    first, last = meetings(leaned(placed, TOO_FAR), cutting, 2e-5)[0]
    assert 0 <= first < last < len(path)


@pytest.mark.slow
def test_axes_that_lean_into_the_part_are_planned_again_without_leaning_or_refused(tmp_path, monkeypatch):
    (tmp_path / "part.stl").write_bytes(dome_stl(cells=12))
    (tmp_path / "job.toml").write_text(job_text().replace("tilt_deg = 0", "tilt_deg = 15"), encoding="utf-8")
    job, asked, stubborn = Job.load(tmp_path / "job.toml"), [], False

    def leaning(toolpath, machine, **options):
        asked.append(options["tilt"])
        placed = plan(toolpath, machine, **{**options, "tilt": 0.0})
        return leaned(placed, TOO_FAR) if stubborn or options["tilt"] > 0.0 else placed

    monkeypatch.setattr(task, "plan", leaning)
    outcome = run(job, tmp_path / "out")
    assert outcome.passed
    assert asked == [np.radians(15.0), 0.0]

    stubborn = True
    outcome = run(job, tmp_path / "refused", advice=None)
    assert outcome.refusal is not None
    assert "the tool touches the part at waypoints" in str(outcome.refusal)
    assert not (tmp_path / "refused" / "program.csv").exists()


def test_what_leans_into_the_part_once_cuts_are_left_out_is_left_out_too(tmp_path, monkeypatch):
    (tmp_path / "part.stl").write_bytes(dome_stl(cells=12))
    text = job_text().replace("tilt_deg = 0", "tilt_deg = 15").replace("spacing_mm = 4", "spacing_mm = 1")
    (tmp_path / "job.toml").write_text(text, encoding="utf-8")
    asked = []

    def planned(toolpath, machine, **options):
        placed = plan(toolpath, machine, **{**options, "start": None})
        asked.append((options["tilt"], options["start"]))
        if len(asked) == 1:
            return UnplacedPath("placement", "short", (Shortfall("test", ((100, 101),), 1.0, "mm"),), attempt=placed)
        if len(asked) == 2:
            axes, tips = placed.axes.copy(), placed.tips.copy()
            wrong = leaned(placed, TOO_FAR)
            axes[200:202], tips[200:202] = wrong.axes[200:202], wrong.tips[200:202]
            return replace(placed, tips=tips, axes=axes)
        return placed

    monkeypatch.setattr(task, "plan", planned)
    outcome = run(Job.load(tmp_path / "job.toml"), tmp_path / "out")
    assert outcome.passed, str(outcome.refusal)
    assert [tilt for tilt, _ in asked] == [np.radians(15.0)] * 3  # never without leaning
    first, second, third = (start for _, start in asked)
    assert first is None
    assert second is not None
    assert third is not second
    mend = outcome.find(Mend)
    assert mend.why == ("test", "the tool touches the part")
    assert len(mend.left_out) == 2
