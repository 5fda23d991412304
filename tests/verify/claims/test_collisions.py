"""Claims about collisions: proven gaps are never above what dense samples find, and each corruption is caught."""

from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly, CubicSpline

from lengths import examples
from pentapod.geometry.solids import Solid
from pentapod.machine.clearance.collision_world import CollisionWorld, Obstacle
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.program.program import Program
from pentapod.verify import verify
from pentapod.verify.replay.clearance_bounds import leg_control_points

LARGE = 1e4  # trimesh counts in units of about this many to the metre
TOOL = (Solid("shank", 6e-3, 0.03, 2e-3, 2e-3), Solid("holder", 0.03, 0.05, 8e-3, 8e-3))


def surface_of(shape):
    return MeshDistance.of(Mesh.of(np.asarray(shape.vertices), np.asarray(shape.faces)))


PART = Obstacle("part", MeshDistance.of(Mesh.of(*cases.hill((41, 31)))), clamped=True, allowance=5e-5)


def post(at, radius=0.01, height=0.3):
    """A closed upright post whose foot stands at a point of the machine frame, towards the base."""
    shape = trimesh.creation.cylinder(radius, height, sections=24)
    shape.apply_translation(np.asarray(at) - [0.0, 0.0, 0.5 * height])
    return shape


def fixture(shape):
    return Obstacle("fixture", surface_of(shape), clamped=False)


def certificates(case, world):
    found = verify(
        case.program,
        case.machine,
        case.toolpath,
        job_digest="job-1",
        **cases.TOLERANCES,
        collision_world=world,
    )
    return {c.claim: c for c in found.certificates}


def failed(case, collision_world):
    return {name for name, c in certificates(case, collision_world).items() if not c.passed}


def dense_gaps(case, shape, every=40, samples=200):
    """Smallest gaps (6,) of legs and spindle from a closed mesh, sampled; negative inside."""
    machine = case.machine
    position, direction = machine.robot.pose(case.program.legs[::every], case.program.component)
    joints = position[:, None] + machine.robot.offsets[:, None] * direction[:, None]
    bases = np.c_[machine.robot.base, np.zeros(5)]
    t = np.linspace(0.0, 1.0, samples)[:, None]
    least = []
    for k in range(5):
        points = (bases[k] + t[:, :, None] * (joints[None, :, k] - bases[k])).reshape(-1, 3)
        least.append(-signed(shape, points).max() - machine.bodies.leg_radius)
    top, nose = machine.robot.offsets.min(), machine.tool_length - machine.bodies.shaft_end
    spindle = position[None] + (top + t[:, :, None] * (nose - top)) * direction[None]
    return np.array([*least, -signed(shape, spindle.reshape(-1, 3)).max() - machine.bodies.shaft_radius])


def signed(shape, points):
    """trimesh's signed distance, positive inside, of the points that may matter."""
    near = np.linalg.norm(points - np.clip(points, *shape.bounds), axis=1) < 0.12
    out = np.full(len(points), -0.12)
    if near.any():
        out[near] = trimesh.proximity.signed_distance(shape.copy().apply_scale(LARGE), LARGE * points[near]) / LARGE
    return out


def beside_leg(case, leg, share, away):
    """A point of the machine frame `away` metres across from leg `leg` at a share of its length, first row."""
    position, direction = (x[0] for x in case.machine.robot.pose(case.program.legs[:1], case.program.component))
    base = np.append(case.machine.robot.base[leg], 0.0)
    joint = position + case.machine.robot.offsets[leg] * direction
    across = np.cross(joint - base, [0.0, 0.0, 1.0])
    return base + share * (joint - base) + away * across / np.linalg.norm(across)


def test_a_good_program_is_clear_of_its_part(good):
    found = certificates(good, CollisionWorld((PART,), TOOL))
    names = {"legs clear of the part", "spindle clear of the part", "tool body clear of the part"}
    names.add("legs clear of the tool body")
    assert names <= found.keys()
    for name in names:
        certificate = found[name]
        assert certificate.passed, certificate
        assert certificate.value > certificate.bound
        assert certificate.bound == pytest.approx(-0.05 if name == "tool body clear of the part" else 0.0)
        assert certificate.unit == "mm"
        assert "for all times" in certificate.method


@pytest.fixture(params=["cubic", "linear"])
def good(request):
    return request.getfixturevalue(request.param)


def test_without_surroundings_nothing_is_claimed(cubic):
    assert not [name for name in certificates(cubic, None) if "clear of" in name]


@pytest.mark.parametrize("leg", range(5))
def test_the_gap_to_a_post_is_proven_and_close(short, leg):
    shape = post(beside_leg(short, leg, 0.7, 0.04), height=0.05)
    sampled = dense_gaps(short, shape, every=10)
    found = certificates(short, CollisionWorld((fixture(shape),)))
    legs, spindle = found["legs clear of the fixture"], found["spindle clear of the fixture"]
    assert legs.passed
    assert legs.value <= 1e3 * sampled[:5].min() + 1e-6
    assert legs.value >= 0.6e3 * sampled[:5].min()
    assert f"leg {1 + sampled[:5].argmin()} comes closest" in legs.method
    assert spindle.value <= 1e3 * sampled[5] + 1e-6


@pytest.mark.parametrize("leg", range(5))
def test_a_post_moved_into_a_leg_is_caught(cubic, leg):
    shape = post(beside_leg(cubic, leg, 0.7, 0.012), height=0.05)
    found = certificates(cubic, CollisionWorld((fixture(shape),)))
    assert "legs clear of the fixture" in {name for name, c in found.items() if not c.passed}
    assert found["legs clear of the fixture"].where.row is not None
    assert found["legs clear of the fixture"].value <= 0.0


def test_the_hull_of_a_stretch_is_of_bernstein_coefficients(short):
    """Against scipy's, which makes them of values and slopes."""
    legs, period = short.program.legs, short.program.period
    slopes = CubicSpline(np.arange(len(legs)), legs, bc_type="clamped")(np.arange(len(legs)), 1)
    replay = cases.replay_of(short)
    intervals = np.array([[0, 1, 2], [40, 41, 42]])
    found = leg_control_points(replay, intervals)
    for row, (first, *_, last) in zip(found, intervals, strict=True):
        knots = np.arange(first, last + 2)
        wanted = BPoly.from_derivatives(knots * period, np.stack([legs[knots], slopes[knots] / period], axis=1)).c
        for k in range(3):
            np.testing.assert_allclose(row[[k, 3 + k, 6 + k]], wanted[:3, k], atol=1e-13)
        np.testing.assert_allclose(row[-1], wanted[3, -1], atol=1e-13)


def test_a_clamped_fixture_moves_with_the_part(short):
    """The same post, told in the workpiece frame."""
    shape = post(beside_leg(short, 1, 0.7, 0.03), height=0.05)
    told = shape.copy()
    told.apply_transform(short.program.placement.inverse().matrix)
    held = Obstacle("fixture", surface_of(told), clamped=True)
    values = [
        certificates(short, CollisionWorld((obstacle,)))["legs clear of the fixture"].value
        for obstacle in (fixture(shape), held)
    ]
    assert values[0] == pytest.approx(values[1], abs=1e-6)


def test_a_plate_in_the_spindles_way_is_caught(cubic):
    tip = cubic.program.placement.apply(cubic.toolpath.tips[:1])[0]
    plate = trimesh.creation.box((0.02, 0.02, 0.004))
    plate.apply_translation(tip - [0.0, 0.0, 0.09])
    assert "spindle clear of the fixture" in failed(cubic, CollisionWorld((fixture(plate),)))


@pytest.mark.parametrize(
    ("holder", "caught"),
    [
        (Solid("holder", 0.03, 0.05, 8e-3, 8e-3), set()),
        (Solid("holder", 0.012, 0.05, 0.02, 0.02), {"tool body clear of the part"}),
        (Solid("shank", 0.006, 0.05, 0.011, 0.011), {"tool body clear of the part"}),
    ],
    ids=["slim", "wide and low", "too thick"],
)
def test_a_longer_holder_is_caught(cubic, holder, caught):
    """Beside a wall 20 mm high that stands 8 mm from where the cuts end."""
    wall = trimesh.creation.box((0.01, 0.02, 0.02))
    wall.apply_translation([0.025, 0.0, 0.01])
    part = Obstacle("part", surface_of(wall), clamped=True, allowance=5e-5)
    wrong = failed(cubic, CollisionWorld((part,), (TOOL[0], holder)))
    assert wrong == caught


def test_a_holder_up_to_the_joints_is_caught(cubic):
    machine = cubic.machine
    lowest = machine.tool_length - machine.robot.offsets.max()
    tall = Solid("holder", 0.03, lowest - 0.002, 0.06, 0.06)
    assert "legs clear of the tool body" in failed(cubic, CollisionWorld((), (tall,)))


def test_the_gap_of_legs_and_tool_is_proven_and_close(cubic):
    """Against distances between many points of leg and holder."""
    machine = cubic.machine
    lowest = machine.tool_length - machine.robot.offsets.max()
    holder = Solid("holder", 0.5 * lowest, lowest - 0.03, 0.02, 0.03)
    value = certificates(cubic, CollisionWorld((), (holder,)))["legs clear of the tool body"].value * 1e-3
    position, direction = machine.robot.pose(cubic.program.legs[::100], cubic.program.component)
    turn = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
    share = np.linspace(0.0, 1.0, 40)
    least = np.inf
    for p, i in zip(position, direction, strict=True):
        side = np.linalg.svd(i[None])[2][1:]
        around = np.cos(turn)[:, None] * side[0] + np.sin(turn)[:, None] * side[1]
        heights = holder.low + share * (holder.high - holder.low)
        radii = holder.low_radius + share * (holder.high_radius - holder.low_radius)
        heights, radii = np.append(heights, np.full(40, holder.high)), np.append(radii, share * holder.high_radius)
        shell = p + (machine.tool_length - heights[:, None, None]) * i + radii[:, None, None] * around
        for k in range(5):
            start, joint = np.append(machine.robot.base[k], 0.0), p + machine.robot.offsets[k] * i
            along = (joint - start) / np.linalg.norm(joint - start)
            at = np.clip((shell - start) @ along, 0.0, np.linalg.norm(joint - start))
            least = min(least, np.linalg.norm(shell - start - at[..., None] * along, axis=-1).min())
    least -= machine.bodies.leg_radius
    assert 0.6 * least <= value <= least + 1e-6


def test_a_program_inside_a_solid_is_caught(cubic):
    """Bodies that never touch the surface, since all of it is around them."""
    box = trimesh.creation.box((6.0, 6.0, 6.0))
    wrong = failed(cubic, CollisionWorld((fixture(box),), TOOL))
    assert {"legs clear of the fixture", "spindle clear of the fixture", "tool body clear of the fixture"} <= wrong


@pytest.fixture(scope="module")
def short(cubic):
    """The first quarter of a second: enough for many trials."""
    program = cubic.program
    return replace(
        cubic,
        program=Program(
            program.period,
            program.legs[:250],
            program.interpolation,
            program.component,
            program.placement,
            program.provenance,
        ),
    )


@settings(max_examples=examples(10, 25))
@given(leg=st.integers(0, 4), share=st.floats(0.2, 1.1), away=st.floats(-0.06, 0.06), radius=st.floats(0.002, 0.02))
def test_no_proof_of_clearance_where_samples_touch(short, leg, share, away, radius):
    shape = post(beside_leg(short, leg, share, away), radius=radius, height=0.04)
    sampled = dense_gaps(short, shape, every=60, samples=400)
    found = certificates(short, CollisionWorld((fixture(shape),)))
    for name, least in (("legs", sampled[:5].min()), ("spindle", sampled[5])):
        certificate = found[f"{name} clear of the fixture"]
        if least <= 0.0:
            assert not certificate.passed
        else:
            assert certificate.value is None or certificate.value <= 1e3 * least + 1e-6
