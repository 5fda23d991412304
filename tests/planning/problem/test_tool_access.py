"""Tool access: the room of a stem between two walls, by hand; and a bound on what any placement has."""

from __future__ import annotations

import numpy as np
import pytest

from pentapod import Mesh
from pentapod.cutters.ball import BallCutter
from pentapod.geometry.rigid import RigidTransform
from pentapod.machine.clearance.collision_world import TOOL_BODY, CollisionWorld
from pentapod.planning.limits.contacts import OPTIONS
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.sampling import best_tilted_margins
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.tool_access import tool_access

RADIUS, WIDE, DEEP, ALLOWED = 2e-3, 10e-3, 12e-3, 50e-6
UP = np.array([0.0, 0.0, 1.0])


def slot() -> Mesh:
    """Two upright walls that face each other, and the floor between them."""
    h, a, b = WIDE / 2.0, -0.03, 0.03
    corners = [[a, -h, DEEP], [b, -h, DEEP], [b, -h, 0], [a, -h, 0], [a, h, DEEP], [b, h, DEEP], [b, h, 0], [a, h, 0]]
    quads = [(0, 3, 2, 1), (3, 7, 6, 2), (7, 4, 5, 6)]
    return Mesh.of(np.array(corners), np.array([tri for a, b, c, d in quads for tri in ((a, b, c), (a, c, d))]))


@pytest.fixture(scope="module")
def world(desk):
    tool = BallCutter(RADIUS).with_stem(desk.bodies.shaft_end)
    return CollisionWorld.of(desk, tool, slot(), allowance=ALLOWED)


def across(tilt, places, nominal=UP):
    centres = np.column_stack([np.zeros(len(places)), places, np.full(len(places), RADIUS)])
    return ToolpathSamples(centres, np.tile(nominal, (len(places), 1)), RADIUS, tilt)


def test_the_room_of_an_upright_stem_is_its_distance_from_the_walls(world):
    comfort = min(RADIUS / 2.0, 20.0 * ALLOWED)
    places = np.linspace(-2.9e-3, 2.9e-3, 13)
    free = WIDE / 2.0 - np.abs(places) - RADIUS + ALLOWED
    expected = np.minimum(free / comfort, OPTIONS.cap)
    np.testing.assert_allclose(tool_access(across(0.0, places), world), expected, atol=0.02)


def test_a_lean_makes_room_beside_a_wall_and_too_steep_an_axis_has_none(world):
    beside = np.array([WIDE / 2.0 - RADIUS - 0.1e-3])
    upright, leaning = (tool_access(across(np.radians(tilt), beside), world)[0] for tilt in (0.0, 10.0))
    assert 0.0 < upright < leaning - 0.01
    flat = np.array([0.0, np.sin(np.radians(60.0)), np.cos(np.radians(60.0))])
    assert tool_access(across(0.0, beside, flat), world)[0] < 0.0


def test_no_placement_has_more_room(world, desk):
    rng = np.random.default_rng(3)
    samples = across(np.radians(12.0), np.linspace(-3e-3, 3e-3, 9))
    margins = Margins.of(desk, desk.robot.branches[0], world)
    column = next(k for k, limit in enumerate(margins.limits) if limit.name.startswith(TOOL_BODY))
    bound = tool_access(samples, world)
    for _ in range(5):
        rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        rotation *= np.sign(np.linalg.det(rotation))
        placed = RigidTransform(rotation, rng.normal(scale=0.1, size=3))
        values, _ = best_tilted_margins(samples, margins, placed)
        assert (values[:, column] <= bound + 1e-6).all()
