"""How large the page of a run is: the demo with its whole mesh, and a long program on a fine part."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from page_arrays import page_arrays, page_data
from pentapod.geometry import RigidTransform
from pentapod.job import Job, run
from pentapod.job.stage_runner import Stage
from pentapod.machine import Machine
from pentapod.planning import PlacedPath
from pentapod.planning.placement.placed_path import Placement
from pentapod.program import Program
from pentapod.report import write_report
from pentapod.report.page import page as page_module
from pentapod.report.signals import Signals
from pentapod.toolpath import Mesh, Segment, SegmentKind, Toolpath

PASSES, POINTS, ROWS = 250, 400, 4
FACETS = 300_000
DEMO = Path(__file__).parents[2] / "toolpaths" / "dome.toml"


def height(x, y):
    """Of a dome 100 mm wide, metres."""
    return 0.02 - 4.0 * (x**2 + y**2)


def fine_part(*, disorder: bool) -> Mesh:
    """The dome in facets; in disorder they come as they may, and their corners are a few micrometres off."""
    count = round((FACETS / 2) ** 0.5) + 1
    x, y = np.meshgrid(np.linspace(-0.06, 0.06, count), np.linspace(-0.06, 0.06, count), indexing="ij")
    vertices = np.stack([x, y, height(x, y)], axis=-1).reshape(-1, 3)
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    halves = [
        np.stack([corner, corner + count, corner + count + 1], 1),
        np.stack([corner, corner + count + 1, corner + 1], 1),
    ]
    faces = np.stack(halves, axis=1).reshape(-1, 3)
    if disorder:
        random = np.random.default_rng(2)
        vertices = vertices + 3e-6 * random.standard_normal(vertices.shape)
        faces = faces[random.permutation(len(faces))]
    return Mesh.of(vertices, faces)


def long_motion(machine: Machine, like: PlacedPath) -> tuple[Toolpath, PlacedPath, Signals]:
    """A raster of 100,000 waypoints on the dome, none on the line of its neighbours, in 400,000 rows."""
    random = np.random.default_rng(3)
    x = np.linspace(-0.05, 0.05, POINTS)
    place = RigidTransform(np.diag([1.0, -1.0, -1.0]), machine.work.centre)
    tips = np.concatenate([
        np.stack([x[:: (-1) ** k], np.full(POINTS, y), height(x, y)], axis=1)
        for k, y in enumerate(np.linspace(-0.05, 0.05, PASSES))
    ])  # fmt: skip
    tips[:, 2] += 8e-5 * random.standard_normal(len(tips))
    axes = np.tile([0.0, 0.0, 1.0], (len(tips), 1))
    segments = (
        Segment(
            SegmentKind.CUT, tips[k * POINTS : (k + 1) * POINTS + 1], axes[k * POINTS : (k + 1) * POINTS + 1], 0.025
        )
        for k in range(PASSES)
    )
    toolpath = Toolpath(tuple(segments))
    way = np.arange(ROWS * (len(tips) - 1) + 1) / ROWS
    moved = place.apply(np.column_stack([np.interp(way, np.arange(len(tips)), column) for column in tips.T]))
    along = np.tile([0.0, 0.0, -1.0], (len(moved), 1))
    legs = machine.robot.leg_lengths(moved + machine.tool_length * along, -along)
    rows = np.arange(0, len(moved), 10)
    margins = 0.5 + 0.3 * np.sin(np.linspace(0.0, 900.0, len(rows))[:, None] + np.arange(20.0))
    rates = np.gradient(legs, 1e-3, axis=0)
    signals = Signals(
        times=1e-3 * np.arange(len(moved)), legs=legs, rates=rates, accelerations=np.gradient(rates, 1e-3, axis=0),
        tips=moved, axes=along, speeds=np.full(len(moved), 0.02), speed_limits=np.full(len(moved), 0.025),
        segments=np.minimum(np.arange(len(moved)) // (POINTS * ROWS), PASSES - 1),
        cutting=np.ones(len(moved), dtype=bool), causes=np.arange(len(moved)) // 900 % 3,
        cause_names=("feed", "leg 1 jerk", "leg 2 acceleration"), margins=margins, margin_rows=rows,
        margin_names=tuple(f"margin {k}" for k in range(20)),
    )  # fmt: skip
    down, margins = np.tile([0.0, 0.0, -1.0], (len(tips), 1)), np.full((len(tips), len(like.limits)), 0.5)
    spot = Placement(place, "by hand")
    placed = PlacedPath(toolpath, spot, like.component, place.apply(tips), down, margins, like.limits)
    return toolpath, placed, signals


@pytest.mark.slow
@pytest.mark.parametrize("disorder", [False, True], ids=["in order", "in disorder"])
def test_a_page_of_100000_waypoints_and_300000_facets_is_below_three_megabytes(
    make_job, tmp_path, monkeypatch, disorder
):
    outcome = run(Job.load(make_job()), tmp_path / "out")
    program, like = outcome.find(Program), outcome.find(PlacedPath)
    assert program is not None
    assert like is not None
    toolpath, placed, signals = long_motion(outcome.machine, like)
    long_program = dataclasses.replace(program, legs=signals.legs)
    mesh = fine_part(disorder=disorder)
    own = {Mesh: mesh, Toolpath: toolpath, PlacedPath: placed, Program: long_program}
    kept = [s for s in outcome.stages if not isinstance(s.value, (*own, tuple))]
    stages = [*(Stage(kind.__name__, 0.0, value) for kind, value in own.items()), *kept]
    monkeypatch.setattr(page_module.Signals, "of", lambda *_, **__: signals)
    path = write_report(dataclasses.replace(outcome, stages=tuple(stages)), tmp_path / "report.html")
    text = path.read_text(encoding="utf-8")
    entries = page_data(text)["arrays"]
    assert entries["key.time"]["rows"] > 90_000
    assert entries["part.faces"]["rows"] >= (0.4 if disorder else 0.99) * FACETS
    assert path.stat().st_size <= 3e6


@pytest.mark.slow
def test_the_page_of_the_demo_is_below_one_and_a_half_megabytes_with_its_whole_mesh(tmp_path):
    outcome = run(Job.load(DEMO), tmp_path / "out")
    path, mesh = write_report(outcome, tmp_path / "report.html"), outcome.find(Mesh)
    assert mesh is not None
    text = path.read_text(encoding="utf-8")
    arrays = page_arrays(text)
    assert len(arrays["part.faces"]) == len(mesh.faces)
    assert np.diff(arrays["plot.x"][::2, 0]).max() < 0.060, "seconds of a bucket"
    assert path.stat().st_size <= 1.5e6
