"""Plans on robots of all families: general and as-built pentapods, judged by formulas that share nothing with them."""

import dataclasses
from itertools import combinations

import casadi as ca
import numpy as np
import pytest
import trimesh
from domes import dome
from scipy.optimize import minimize

from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.kinematics.families.general import GeneralPentapod
from pentapod.machine.clearance.collision_world import CollisionWorld, Obstacle
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.planning import PlacedPath, PlacementConstraints, leg_path, plan
from pentapod.planning.limits.margins import Margins


def general(desk):
    """Offsets that are not proportional to any coordinate of the base."""
    off = np.array([0.004, -0.006, 0.0, 0.005, -0.003])
    return GeneralPentapod(desk.robot.base, desk.robot.offsets + off)


def as_built(desk):
    """Base joints off the plane, heights, rings and zeros."""
    rng = np.random.default_rng(0)
    return AsBuiltPentapod.of(
        desk.robot,
        base_errors=rng.uniform(-1e-3, 1e-3, (5, 3)),
        offset_errors=rng.uniform(-1e-3, 1e-3, 5),
        radii=[0.0, 0.004, 0.006, 0.0, 0.005],
        zeros=rng.uniform(-2e-3, 2e-3, 5),
    )


@pytest.fixture(scope="module", params=[general, as_built], ids=["general", "as_built"])
def machine(request, desk):
    return dataclasses.replace(desk, robot=request.param(desk))


@pytest.fixture(scope="module")
def placed(machine):
    turn = RigidTransform(np.diag([1.0, -1.0, -1.0]), machine.work.centre)
    near = PlacementConstraints.free(
        low=turn.translation - 0.02, high=turn.translation + 0.02, reference=turn, largest_turn=0.2
    )
    down = np.array([0.0, 0.0, 1.0])
    signs = machine.robot.branch(turn.translation - machine.tool_length * down, down)
    branch = next(branch for branch in machine.robot.branches if (signs == branch).all())
    answer = plan(dome(0.06, 20.0, 40), machine, tilt=np.radians(5.0), constraints=near, component=branch)
    assert isinstance(answer, PlacedPath), str(answer)
    return answer


def joints(machine, tip, axis):
    """Base and platform joints (5, 3), from positions alone: a ring's joint is its point nearest to the base joint."""
    robot = machine.robot
    base, line = robot.base_joints, tip + np.outer(machine.tool_length - robot.offsets, axis)
    off = base - line
    off = off - np.outer(off @ axis, axis)
    radii = getattr(robot, "radii", np.zeros(5))
    return base, line + radii[:, None] * off / np.linalg.norm(off, axis=1, keepdims=True)


def gap(a, b, c, d):
    """Distance of the segments from a to b and from c to d."""

    def square(x):
        return np.sum(np.square(a + x[0] * (b - a) - c - x[1] * (d - c)))

    starts = ((0.1, 0.1), (0.9, 0.9), (0.5, 0.5))
    return np.sqrt(min(minimize(square, s, bounds=[(0, 1)] * 2, options={"ftol": 1e-16}).fun for s in starts))


def test_margins_of_a_plan_are_those_of_joints_in_space(machine, placed):
    named = dict(zip(placed.margin_names, placed.margins.T, strict=True))
    legs, cones = machine.legs, machine.joints
    for row in range(0, len(placed.tips), 9):
        base, platform = joints(machine, placed.tips[row], placed.axes[row])
        vectors = platform - base
        lengths = np.linalg.norm(vectors, axis=1)
        read = lengths + getattr(machine.robot, "zeros", 0.0)
        half = 0.5 * (legs.max_length - legs.min_length)
        for k in range(5):
            assert named[f"leg {k + 1} too short"][row] == pytest.approx((read[k] - legs.min_length[k]) / half[k])
            assert named[f"leg {k + 1} too long"][row] == pytest.approx((legs.max_length[k] - read[k]) / half[k])
            edge = np.cos(cones.base_cone[k])
            cosine = vectors[k] @ cones.base_axes[k] / lengths[k]
            assert named[f"base joint {k + 1} beyond its cone"][row] == pytest.approx((cosine - edge) / (1.0 - edge))
            low, high = np.cos(cones.platform_range[k, ::-1])
            cosine, scale = -vectors[k] @ placed.axes[row] / lengths[k], 0.5 * (high - low)
            beyond = named[f"platform joint {k + 1} beyond its largest angle"][row]
            assert beyond == pytest.approx((cosine - low) / scale)
        for j, k in combinations(range(5), 2):
            apart = gap(base[j], platform[j], base[k], platform[k]) - 2.0 * machine.bodies.leg_radius
            assert named[f"legs {j + 1} and {k + 1} touch"][row] == pytest.approx(apart / 0.05, abs=1e-4)


def test_a_plan_stays_on_its_branch(machine, placed):
    signs = machine.robot.branch(placed.tips + machine.tool_length * placed.axes, -placed.axes)
    assert (signs == np.array(placed.component)).all()
    assert placed.smallest_margin > 0.02


def test_leg_path_derivatives_are_those_of_the_readings(machine, placed):
    path = leg_path(placed, machine, path_tolerance=50e-6, axis_tolerance=np.radians(0.5))
    piece = path.pieces[0]
    s = np.linspace(0.2, 0.8, 7) * piece.length
    tips, axes = piece.pose(s)
    np.testing.assert_allclose(
        piece(s), machine.robot.leg_lengths(tips + machine.tool_length * axes, -axes), atol=1e-12
    )
    h = 1e-6
    for order in (1, 2, 3):
        difference = (piece(s + h, order - 1) - piece(s - h, order - 1)) / (2.0 * h)
        scale = np.abs(difference).max()
        np.testing.assert_allclose(piece(s, order), difference, atol=2e-4 * scale)


def test_margins_and_their_formulas_agree_beside_an_obstacle(machine, placed):
    post = trimesh.creation.cylinder(0.01, 0.2, sections=16)
    post.apply_translation([0.06, 0.02, 0.1])
    surface = MeshDistance.of(Mesh.of(np.asarray(post.vertices), np.asarray(post.faces)))
    margins = Margins.of(machine, placed.component, CollisionWorld((Obstacle("fixture", surface, clamped=True),)))
    here = placed.placement.transform
    tip, axis, turn, shift = (ca.SX.sym("x", *size) for size in ((3,), (3,), (3, 3), (3,)))
    numbers = ca.SX.sym("c", margins.contact_numbers)
    formula = ca.Function("f", [tip, axis, turn, shift, numbers], [margins.symbolic(tip, axis, turn, shift, numbers)])
    values = margins(placed.tips, placed.axes, here)
    contacts = margins.contacts(placed.tips, placed.axes, here)
    assert (values[:, -6:] < 1.19).any()
    for row, (t, a, c) in enumerate(zip(placed.tips, placed.axes, contacts, strict=True)):
        found = formula(t, a, here.rotation, here.translation, c)
        np.testing.assert_allclose(np.asarray(found).ravel(), values[row], atol=1e-9)
