"""Margins of bodies against meshes: true gaps, their formula at contacts, and plans that keep clear of a fixture."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
import trimesh

from pentapod.geometry.rigid import RigidTransform
from pentapod.geometry.solids import Solid
from pentapod.kinematics.component import Component
from pentapod.kinematics.mode import Mode
from pentapod.machine import Machine
from pentapod.machine.clearance.collision_world import CollisionWorld, Obstacle
from pentapod.machine.clearance.leg_clearance import clearances
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.planning.diagnosis import diagnose
from pentapod.planning.limits.contacts import contacts
from pentapod.planning.limits.limit import Comforts
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.ipopt import IpoptSolver
from pentapod.planning.placement.sampling import SamplingOptions, first_candidate, first_guesses
from pentapod.planning.placement.sequential import SequentialSolver
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.formulation import step_slopes, stepped
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.weights import EVEN, Weights
from pentapod.planning.tool_axis.spline import AxisSpline

PLUS = Component(1, 1)
TILT = np.radians(15.0)
TOOL = (Solid("shank", 0.006, 0.03, 0.002, 0.003), Solid("holder", 0.03, 0.055, 0.012, 0.02))


def surface_of(shape: trimesh.Trimesh) -> MeshDistance:
    return MeshDistance.of(Mesh.of(np.asarray(shape.vertices), np.asarray(shape.faces)))


def post(x: float, y: float, foot: float, height: float, radius: float = 0.01) -> trimesh.Trimesh:
    """A closed upright post of the workpiece frame."""
    shape = trimesh.creation.cylinder(radius, height, sections=16)
    shape.apply_translation([x, y, foot + 0.5 * height])
    return shape


def poses(machine, count, seed=0):
    rng = np.random.default_rng(seed)
    tips = machine.work.centre + rng.uniform(-0.05, 0.05, (count, 3))
    axes = np.c_[rng.uniform(-0.3, 0.3, (count, 2)), -np.ones(count)]
    return tips, axes / np.linalg.norm(axes, axis=1, keepdims=True)


@pytest.fixture(scope="module")
def crowd():
    return crowd_with_fence_at([0.25, 0.0, 0.35])


def crowd_with_fence_at(middle):
    """A post that moves with the part and a fence that does not, with shank and holder on the tool."""
    fence = trimesh.creation.box((0.02, 0.3, 0.2))
    fence.apply_translation(middle)
    return CollisionWorld(
        (
            Obstacle("fixture", surface_of(post(0.06, 0.02, -0.02, 0.06)), clamped=True),
            Obstacle("table", surface_of(fence), clamped=False),
        ),
        TOOL,
    )


def at_work(machine):
    return RigidTransform(np.diag([1.0, -1.0, -1.0]), machine.work.centre)


@pytest.fixture(scope="module")
def place(desk):
    return at_work(desk)


def test_limits_are_named_in_the_order_of_the_values(desk, crowd, place):
    margins = Margins.of(desk, PLUS, crowd)
    listed = [limit.name for limit in margins.limits]
    bodies = [*(f"leg {k}" for k in range(1, 6)), "spindle", "tool body"]
    assert listed[-14:] == [f"{body} touches the {obstacle}" for obstacle in ("fixture", "table") for body in bodies]
    assert "leg 3 touches the fixture" in listed
    assert "tool body touches the table" in listed
    tips, axes = poses(desk, 7)
    assert margins(tips, axes, place).shape == (7, len(listed))
    assert margins(tips.reshape(1, 7, 3), axes.reshape(1, 7, 3), place).shape == (1, 7, len(listed))
    np.testing.assert_array_equal(margins(tips, axes, place, block=3), margins(tips, axes, place))
    assert contacts(margins.scene, tips[:0], axes[:0], place).margins.shape == (0, 14)


def test_gaps_between_legs_and_spindle_are_those_of_the_machine(desk):
    """Against distances of segments in space, which know of no plane of leg and axis."""
    tips, axes = poses(desk, 500, seed=1)
    found = Margins.of(desk, PLUS)(tips, axes)[:, -5:] * Comforts().tool
    np.testing.assert_allclose(found, clearances(desk, tips + desk.tool_length * axes, -axes)[:, 10:], atol=1e-7)


def test_margins_are_distances_of_samples(desk, crowd, place):
    tips, axes = poses(desk, 5, seed=2)
    room = Comforts()
    comforts = np.tile([*[room.leg_obstacle] * 5, room.spindle_obstacle, room.tool_obstacle], 2)
    outer, caps = Margins.of(desk, PLUS, crowd)(tips, axes, place)[:, -14:] * comforts, 1.2 * comforts
    fixture = post(0.06, 0.02, -0.02, 0.06).apply_transform(place.matrix)
    position = tips + desk.tool_length * axes
    t = np.linspace(0.0, 1.0, 200)[:, None]
    for row in range(len(tips)):
        for leg in range(5):
            start = np.append(desk.robot.base[leg], 0.0)
            joint = position[row] - desk.robot.offsets[leg] * axes[row]
            samples = start + t * (joint - start)
            large = fixture.copy().apply_scale(1e4)
            oracle = -trimesh.proximity.signed_distance(large, 1e4 * samples).max() / 1e4 - desk.bodies.leg_radius
            assert outer[row, leg] == pytest.approx(min(oracle, caps[leg]), abs=2e-3)


@pytest.mark.parametrize("enough", [0.05, 0.5, 2.0])
def test_margins_of_obstacles_that_are_large_enough_need_not_be_exact(enough, desk, crowd, place):
    tips, axes = poses(desk, 400, seed=5)
    margins = Margins.of(desk, PLUS, crowd)
    exact, own = margins(tips, axes, place), len(margins.own_limits)
    found = margins(tips, axes, place, enough=enough)
    np.testing.assert_array_equal(found[:, :own], exact[:, :own])
    np.testing.assert_allclose(found[:, own:], np.minimum(exact[:, own:], enough), atol=2e-3 if enough < 1.0 else 0.0)
    assert (exact[:, own:] < enough).any()


def test_no_pose_has_no_margins(desk, crowd, place):
    """A program whose waypoints all keep what they had asks for none."""
    margins = Margins.of(desk, PLUS, crowd)
    assert margins(np.zeros((0, 3)), np.zeros((0, 3)), place).shape == (0, len(margins.limits))


def test_a_waypoint_that_needs_room_has_smaller_margins_to_obstacles_alone(desk, crowd, place):
    tips = 0.02 * np.random.default_rng(6).normal(size=(30, 3)) + [0.06, 0.02, 0.01]
    samples = ToolpathSamples(tips, np.tile([0.0, 0.0, 1.0], (30, 1)), 0.0, TILT)
    fixed = PlacementConstraints.fixture([place])
    plain = PlacementProblem.of(samples, desk, fixed, component=PLUS, collision_world=crowd)
    spare = np.where(np.arange(30) < 10, 0.3, 0.0)
    rows, leans, margins = np.array([2, 5, 20]), np.zeros((3, 3)), plain.margins[0]
    own = len(margins.own_limits)
    for weights in (EVEN, Weights(bodies=2.0)):
        problem = replace(plain, weights=weights)
        roomy = replace(problem, spare=spare)
        before, after = (each.values_of(margins, place, leans, rows) for each in (problem, roomy))
        np.testing.assert_array_equal(after[:, :own], before[:, :own])
        less = spare[rows, None] / weights.bodies
        np.testing.assert_allclose(after[:, own:], before[:, own:] - less, atol=1e-12)
        np.testing.assert_array_equal(roomy.at(rows).values_of(margins, place, leans), after)
        quick = roomy.values_of(margins, place, leans, rows, enough=0.4)
        assert (quick >= np.minimum(after, 0.4) - 1e-12).all()


@pytest.mark.parametrize(
    ("name", "fence"),
    [
        ("desk", [0.25, 0.0, 0.35]),
        pytest.param("spr", [-0.24, -0.15, 0.12], marks=pytest.mark.slow),
        pytest.param("prpu", [-0.2, 0.15, 0.15], marks=pytest.mark.slow),
    ],
)
def test_the_formula_equals_the_margins_and_their_slopes(name, fence):
    """At the poses where contacts were taken: the value, and central differences of the true margins."""
    machine, crowd = Machine.load(name), crowd_with_fence_at(fence)
    tips, axes = poses(machine, 80, seed=3)
    branch = machine.robot.branch(tips[0] + machine.tool_length * axes[0], -axes[0])
    margins, place = Margins.of(machine, Mode(*branch.tolist()), crowd), at_work(machine)
    count = len(margins.limits) - len(margins.own_limits)
    tip, axis, turn, shift = (ca.SX.sym("x", *size) for size in ((3,), (3,), (3, 3), (3,)))
    numbers = ca.SX.sym("c", margins.contact_numbers)
    whole = margins.symbolic(tip, axis, turn, shift, numbers)[-count:]
    function = ca.Function("f", [tip, axis, turn, shift, numbers], [whole, ca.jacobian(whole, ca.vertcat(tip, axis))])
    contacts, values = margins.contacts(tips, axes, place), margins(tips, axes, place)[:, -count:]
    rng, close, seen = np.random.default_rng(4), 0, 0
    for row in range(len(tips)):
        value, slope = function(tips[row], axes[row], place.rotation, place.translation, contacts[row])
        np.testing.assert_allclose(np.asarray(value).ravel(), values[row], atol=1e-9)
        way, turned = rng.normal(size=3), np.cross(rng.normal(size=3), axes[row])

        def moved(h, row=row, way=way, turned=turned):
            axis = axes[row] + h * turned
            pose = (tips[row] + h * way)[None], (axis / np.linalg.norm(axis))[None]
            return margins(*pose, place)[0, -count:]

        h = 1e-4
        differences = (moved(h) - moved(-h)) / (2.0 * h)
        near = (values[row] < 1.15) & (values[row] > 0.05)
        promised = np.asarray(slope) @ np.concatenate([way, turned])
        close += int((np.abs(promised - differences) < 0.02 * (1.0 + np.abs(differences)))[near].sum())
        seen += int(near.sum())
    assert seen > 50
    assert close > 0.95 * seen  # the rest have two nearest points, or a tool's distance known to 10 µm only


def test_without_obstacles_nothing_changes(desk, cap):
    plain, empty = Margins.of(desk, PLUS), Margins.of(desk, PLUS, CollisionWorld())
    tips, axes = poses(desk, 20)
    np.testing.assert_array_equal(plain(tips, axes), empty(tips, axes))
    assert plain.contacts(tips, axes, RigidTransform(np.eye(3), np.zeros(3))).shape == (20, 0)


@pytest.fixture(scope="module")
def problem(desk, cap):
    return PlacementProblem.of(ToolpathSamples.of(cap, TILT), desk, component=PLUS)


@pytest.fixture(scope="module")
def free(desk, problem):
    """A first guess where nothing is in the way."""
    guess = next(first_guesses(problem, options=SamplingOptions(tries=2000)))
    return first_candidate(problem, guess.margins, guess.transform)


def beside(desk, problem, free, leg, away):
    """A post of the workpiece frame, its middle `away` metres across from a leg in the middle of the path."""
    row = len(problem.samples.tilt_centres) // 2
    tip, axis = (
        x[0] for x in problem.samples.machine_poses(free.transform, problem.axes(free.coefficients, [row]), [row])
    )
    start = np.append(desk.robot.base[leg], 0.0)
    joint = tip + (desk.tool_length - desk.robot.offsets[leg]) * axis
    across = np.cross(joint - start, free.transform.rotation[:, 2])
    at = start + 0.9 * (joint - start) + away * across / np.linalg.norm(across)
    x, y, z = free.transform.inverse().apply(at)
    return Obstacle("fixture", surface_of(post(x, y, z - 0.05, 0.1, 0.006)), clamped=True)


@pytest.fixture(scope="module")
def grazing(desk, problem, free):
    """Margins with a post that a leg runs through, a little, somewhere on the path."""
    for away in np.arange(-0.05, -0.3, -0.004):
        margins = Margins.of(desk, PLUS, CollisionWorld((beside(desk, problem, free, 1, away),)))
        if problem.values(margins, free.transform, free.coefficients)[:, -6:].min() > -0.15:
            return margins
    raise AssertionError("the post is never out of the way")


def test_the_solver_moves_away_from_a_fixture(problem, free, grazing):
    start = problem.candidate(grazing, free.transform, free.coefficients)
    found = SequentialSolver(problem, True).raise_margin(start)
    assert start.smallest < 0.0 < found.smallest


def test_the_reference_moves_away_from_a_fixture(desk, cap, free, grazing):
    """On few waypoints: what takes IPOPT long is not what is tested here."""
    few = PlacementProblem.of(ToolpathSamples.of(cap, TILT).at(np.arange(0, len(cap), 20)), desk)
    start = few.candidate(grazing, free.transform, few.upright)
    found = IpoptSolver(few, True).raise_margin(start)
    ours = SequentialSolver(few, True).raise_margin(start)
    assert start.smallest < 0.0 < found.smallest
    assert ours.smallest > 0.7 * found.smallest


def test_the_linear_model_knows_contacts(desk, cap, problem, free):
    crowded = CollisionWorld((beside(desk, problem, free, 1, -0.09),), TOOL)
    margins = Margins.of(desk, PLUS, crowded)
    rows = np.arange(0, len(cap), 8)
    slopes = step_slopes(problem, margins)(margins, free.transform, free.coefficients, rows)
    step = 1e-5 * np.random.default_rng(5).normal(size=6)

    def values(sign):
        return problem.values(margins, stepped(free.transform, sign * step), free.coefficients, rows)

    differences, promised = 0.5 * (values(1.0) - values(-1.0)), slopes[..., :6] @ step
    smooth = np.abs(promised - differences) < 1e-3 * np.abs(step).max() * (1.0 + np.abs(slopes).sum(axis=2))
    assert smooth[:, 37:].mean() > 0.97
    assert np.abs(slopes[:, -7:, :6]).max() > 1.0


def test_smoothing_keeps_clear_of_a_fixture(desk, problem, free):
    margins = Margins.of(desk, PLUS, CollisionWorld((beside(desk, problem, free, 1, -0.09),)))
    start = problem.candidate(margins, free.transform, free.coefficients)
    keep = start.smallest - 0.05
    smooth = SequentialSolver(problem, False).smooth(start, keep)
    if smooth is not None:
        assert (
            problem.values_of(margins, free.transform, AxisSpline.of(problem.samples, problem.cone).leans(smooth)).min()
            >= keep - 1e-4
        )


def test_a_refusal_names_the_fixture(desk, problem, free):
    """A wide plate across the legs."""
    plate = trimesh.creation.box((0.5, 0.5, 0.01))
    plate.apply_translation([0.0, 0.0, 0.16])
    margins = Margins.of(desk, PLUS, CollisionWorld((Obstacle("fixture", surface_of(plate), clamped=True),)))
    values = problem.values(margins, free.transform, free.coefficients)
    named = {b.constraint: b for b in diagnose(values, margins, 0.02) if b.constraint.endswith("touches the fixture")}
    assert "spindle touches the fixture" in named
    assert all(b.unit == "mm" and b.shortfall > 0.0 and b.waypoints for b in named.values())
    depth = named["spindle touches the fixture"].shortfall
    assert depth >= 1e3 * desk.bodies.shaft_radius


def test_first_guesses_see_the_fixture(desk, problem, free):
    crowded = CollisionWorld((beside(desk, problem, free, 1, 0.0),))
    plain = next(first_guesses(problem, options=SamplingOptions(tries=1500)))
    there = PlacementProblem.of(problem.samples, desk, component=PLUS, collision_world=crowded)
    seen = next(first_guesses(there, options=SamplingOptions(tries=1500)))
    assert seen.margin <= plain.margin
