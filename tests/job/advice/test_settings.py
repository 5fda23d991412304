"""Settings and smaller regions of a refused job, by estimates."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pentapod.base.refusal import Shortfall
from pentapod.geometry.directions import normalised
from pentapod.geometry.rigid import RigidTransform
from pentapod.job import Job
from pentapod.job.advice.axes import axis_choices
from pentapod.job.advice.options import OPTIONS
from pentapod.job.advice.parts import Regions
from pentapod.job.advice.settings import Setting, Settings, met_below
from pentapod.job.advice.sketch import Sketch
from pentapod.job.build.tool import job_tool
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.planning.problem.constraints import FREE
from pentapod.toolpath.toolpath import SegmentKind
from refused_jobs import REFUSED

JAMMED = replace(REFUSED["thick legs"], edits=(("leg_diameter_mm = 16", "leg_diameter_mm = 60"),))
"""Legs that touch each other wherever the tool is."""


def loaded(folder, name):
    job = Job.load((JAMMED if name == "jammed" else REFUSED[name]).write(folder))
    machine, mesh = job_machine(job), job_mesh(job)
    return job, machine, mesh, job_tool(job, machine)


@pytest.mark.parametrize(("kind", "corner"), [("ball", None), ("bull", 1.0), ("flat", None)])
@pytest.mark.parametrize("axis", [{"mode": "normal"}, {"mode": "fixed", "direction": [0.0, 0.0, 1.0]}])
def test_heights_where_the_tool_touches_the_part_are_those_of_contacts(kind, corner, axis, tmp_path):
    """On a sphere about the origin they follow from the slope; an upright end may touch anywhere on its rounding."""
    job = Job.load(REFUSED["dome of 55 deg, flat end"].write(tmp_path))
    job = job.with_(tool={"type": kind, "corner_mm": corner}, axis={**axis, "tilt_deg": None})
    mesh = job_mesh(job)
    path, _ = job_toolpath(job, mesh)
    starts, kinds = path.starts, [segment.kind for segment in path.segments]
    cut = max(np.flatnonzero([kind is SegmentKind.CUT for kind in kinds]), key=lambda k: starts[k + 1] - starts[k])
    rows = range(int(starts[cut]) + 1, int(starts[cut + 1]))
    short = [Shortfall("spindle touches the part", ((rows[0], rows[-1]),), 1.0, "mm")]
    highest = met_below(job, mesh, path, short, OPTIONS)[-1]
    tips, rounding = path.tips[rows], {"ball": 3e-3, "bull": 1e-3, "flat": 0.0}[kind]
    if axis["mode"] == "normal":
        assert highest == pytest.approx(tips[:, 2].max(), abs=1e-9)
        return
    if kind == "ball":
        assert highest == pytest.approx(40.0 / 43.0 * (tips[:, 2].max() + rounding), abs=5e-5)
        return
    across = np.linalg.norm(tips[:, :2], axis=1) - (3e-3 - rounding)  # of the middle of the rounding
    contacts = 40e-3 * np.sqrt(1.0 - (across / (40e-3 + rounding)) ** 2)
    assert contacts.max() - 5e-5 <= highest <= contacts.max() + rounding + 5e-5


@pytest.mark.parametrize(("name", "never"), [("jammed", "legs "), ("narrow base cones", "")])
def test_a_machine_that_reaches_no_place_is_told_from_a_part_that_does_not_fit(name, never, tmp_path):
    job, machine, mesh, tool = loaded(tmp_path, name)
    settings = Settings(job, machine, mesh, Sketch.of_region(job, mesh, tool, 24), None, OPTIONS, lambda _: None)
    short = settings.beyond_a_single_place()
    assert (short[0].constraint[: len(never)] == never) if never else short == ()


def test_the_top_of_a_part_is_flat_and_as_deep_as_its_share(tmp_path):
    job, _, mesh, tool = loaded(tmp_path, "holder wider than a pocket")
    found = Regions.of(job, mesh, tool, None, OPTIONS).top(0.1)
    low, high = np.array(found.changes["part"]["region_box_mm"])
    top = 1e3 * mesh.bounds[1, 2]
    assert top - 3.0 < low[2] < top < high[2]
    assert found.sketch.contacts[:, 2].min() > 1e-3 * low[2] - 1e-9
    assert 0.0 < found.share < 0.5


def test_boxes_about_a_hole_lie_beside_it(tmp_path):
    job, _, mesh, tool = loaded(tmp_path, "plate of 900 x 100")
    middle = np.abs(mesh.vertices[mesh.faces].mean(axis=1)[:, 0]) < 0.15
    holed = type(mesh).of(mesh.vertices, mesh.faces[~middle])
    for part, beside in ((mesh, False), (holed, True)):
        box = Regions.of(job, part, tool, None, OPTIONS).boxed(0.1)
        low, high = np.array(box.changes["part"]["region_box_mm"])
        assert (low[0] * high[0] > 0.0) == beside
        assert high[1] - low[1] == pytest.approx(90.0)


@pytest.mark.slow
def test_a_smaller_region_is_judged_at_places_that_the_tool_reaches(tmp_path):
    """At the foot of a wall a ball's centre is a radius away from both sides, and so is its stem."""
    job, machine, mesh, tool = loaded(tmp_path, "pocket_boss along normals")
    toolpath = job_toolpath(job, mesh, machine=machine)[0]
    for known, clear in ((None, False), (toolpath, True)):
        box = Regions.of(job, mesh, tool, known, OPTIONS).boxed(0.9)
        low, high = 1e-3 * np.array(box.changes["part"]["region_box_mm"])
        places = box.sketch.contacts[: len(box.sketch.contacts) // 2]
        assert ((places > low - 2e-6) & (places < high + 2e-6)).all()
        centres = places + tool.tilt_centre * box.sketch.normals[: len(places)]
        assert (MeshDistance.of(mesh).points(centres).distance.min() > 0.99 * tool.tilt_centre) == clear


@pytest.mark.parametrize(("name", "offered"), [("dome of 85 deg", True), ("dome of 60 deg, beam", False)])
def test_one_direction_suits_a_ball_under_an_overhang_but_no_beam_at_a_wall(name, offered, tmp_path):
    job, _, _, tool = loaded(tmp_path, name)
    normals = normalised(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 0.0, -0.1]]))
    found = axis_choices(job, tool, Sketch(tool, np.eye(3), normals, normals), FREE, OPTIONS)
    directions = [choice.changes["axis"].get("direction") for choice in found if "axis" in choice.changes]
    assert ([0.0, 0.0, 1.0] in directions) == offered


def test_a_table_beside_the_base_is_no_advice(tmp_path):
    job, machine, mesh, tool = loaded(tmp_path, "table too low")
    settings = Settings(job, machine, mesh, Sketch.of_region(job, mesh, tool, 24), None, OPTIONS, lambda _: None)
    own, table, *_ = settings.places
    middle = settings.sketch.contacts.mean(axis=0)
    for height, usual in ((machine.work.centre[2], True), (-0.05, False)):
        moved = RigidTransform(np.eye(3), np.array([*machine.work.centre[:2], height]) - middle)
        estimate = SimpleNamespace(candidate=SimpleNamespace(transform=moved))
        assert settings.is_usual(Setting(settings.axes[0], own, estimate))  # what the job says is what is wanted
        assert settings.is_usual(Setting(settings.axes[0], table, estimate)) == usual
