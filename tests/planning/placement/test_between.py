"""Leans whose tool is clear between waypoints: those beside a place where it is not get more room."""

import importlib
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from pentapod.geometry.rigid import RigidTransform
from pentapod.geometry.solids import Solid
from pentapod.machine.clearance.collision_world import CollisionWorld, Obstacle
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.planning.placement import between
from pentapod.planning.placement.between import OPTIONS, clear_between
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

COUNT = 120


@pytest.fixture(scope="module")
def along_a_wall(desk):
    """A path 2.05 mm beside a wall of 30 mm, with a shank of 2 mm radius: problem, candidate, upright leans."""
    wall = trimesh.creation.box((0.1, 0.01, 0.03))
    wall.apply_translation([0.0, 0.00705, 0.015])
    world = CollisionWorld(
        (Obstacle("wall", MeshDistance.of(Mesh.of(wall.vertices, wall.faces)), clamped=True),),
        (Solid("shank", 0.01, 0.05, 0.002, 0.002),),
    )
    here = RigidTransform(np.diag([1.0, -1.0, -1.0]), desk.work.centre)
    centres = np.c_[np.linspace(-0.04, 0.04, COUNT), np.zeros((COUNT, 2))]
    samples = ToolpathSamples(centres, np.tile([0.0, 0.0, 1.0], (COUNT, 1)), 0.0, np.radians(15.0))
    problem = PlacementProblem.of(samples, desk, PlacementConstraints.fixture([here]), collision_world=world)
    return problem, problem.candidate(problem.margins[0], here, problem.upright), np.zeros((COUNT, 3))


def room(problem, at, leans):
    """The margin of the tool body from the wall."""
    return problem.values_of(at.margins, at.transform, leans)[:, -1]


def test_waypoints_beside_a_meeting_get_more_room_until_there_is_none(along_a_wall):
    problem, at, leans = along_a_wall
    before = room(problem, at, leans)
    asked = []

    def meetings(found):
        """The tool meets the wall between waypoints 50 and 52 unless both have 0.25 more than upright."""
        asked.append(found)
        return () if (room(problem, at, found) - before)[50:53].min() > 0.25 else ((50, 52),)

    found = clear_between(problem, at, leans, meetings)
    assert len(asked) == 4  # 0.1 and 0.2 are not enough, 0.4 is
    assert meetings(found) == ()
    assert room(problem, at, found).min() > before.min() - 0.02


def test_leans_that_are_clear_stay_as_they_are(along_a_wall):
    problem, at, leans = along_a_wall
    assert clear_between(problem, at, leans, lambda _: ()) is leans


def test_where_none_are_clear_the_fewest_waypoints_count(along_a_wall, monkeypatch):
    problem, at, leans = along_a_wall
    met = [((10, 20), (50, 52)), ((50, 52),), ((50, 53), (60, 61)), ((50, 59),), ((50, 70),)]
    seen = []

    def meetings(found):
        seen.append(found)
        return met[len(seen) - 1]

    assert clear_between(problem, at, leans, meetings) is seen[1]
    assert len(seen) == OPTIONS.rounds + 1
    # Nor are others looked for where the margin at waypoints would be lost.
    beside = leans + np.array([0.0, 0.2, 0.0])
    assert room(problem, at, beside).min() < 0.0
    monkeypatch.setattr(between, "restored_along_spline", lambda *_: beside)
    assert clear_between(problem, at, leans, lambda _: met[0]) is leans


def test_room_is_added_beside_the_places_and_grows(along_a_wall, monkeypatch):
    problem, at, leans = along_a_wall
    spares = []
    monkeypatch.setattr(between, "restored_along_spline", lambda there, *_: spares.append(there.spare) or leans)
    clear_between(problem, at, leans, lambda _: ((50, 52),) if len(spares) < 2 else ((0, 1),))
    assert [np.flatnonzero(each).tolist() for each in spares[:2]] == [[49, 50, 51, 52, 53]] * 2
    assert spares[1].max() == OPTIONS.more * spares[0].max() == OPTIONS.more * OPTIONS.first
    assert spares[2][:3].tolist() == [OPTIONS.first] * 3
    assert spares[2][50] == spares[1][50]
    assert replace(problem, spare=spares[0]).spare is spares[0]


def test_a_plan_whose_tool_is_clear_is_placed_and_looked_at_once(desk, monkeypatch):
    """Margins and meetings of a long path take seconds; whoever asked gets the very path that was looked at."""
    planner = importlib.import_module("pentapod.planning.plan")
    made, looked, path = [], [], planner._path
    monkeypatch.setattr(planner, "_path", lambda *given: made.append(path(*given)) or made[-1])
    here = RigidTransform(np.diag([1.0, -1.0, -1.0]), desk.work.centre)
    tips = np.c_[np.linspace(-0.02, 0.02, 40), np.zeros((40, 2))]
    line = Toolpath((Segment(SegmentKind.CUT, tips, np.tile([0.0, 0.0, 1.0], (40, 1)), 0.02),), 0.003)
    asked = {"tilt": 0.2, "constraints": PlacementConstraints.fixture([here])}
    placed = planner.plan(line, desk, meetings=lambda each: looked.append(each) or (), **asked)
    assert len(made) == len(looked) == 1
    assert placed is looked[0] is made[0]
