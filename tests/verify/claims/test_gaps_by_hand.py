"""Gaps between bodies that can be told by hand: a machine that stands, and the corner of something beside it."""

from dataclasses import replace

import numpy as np
import pytest
import replay_cases as cases
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize

from pentapod.geometry.solids import Solid
from pentapod.kinematics import LinearPentapod
from pentapod.machine.clearance.collision_world import CollisionWorld, Obstacle
from pentapod.machine.clearance.leg_clearance import pair_names
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import TOOL_RESOLUTION_M, MeshDistance
from pentapod.toolpath.toolpath import SegmentKind
from pentapod.verify.claims.bodies import clearance
from pentapod.verify.claims.collisions import body_displacements, claims, line_offsets
from pentapod.verify.replay.clearance_bounds import Displacement, clearance_bound, displacements, travels

SHANK = Solid("shank", 0.006, 0.03, 2e-3, 2e-3)
HOLDER = Solid("holder", 0.03, 0.05, 8e-3, 8e-3)
ROWS = 130  # more than one stretch


@pytest.fixture(scope="module")
def still(cubic):
    legs = np.repeat(cubic.program.legs[:1], ROWS, axis=0)
    return cases.replay_of(cubic, replace(cubic.program, legs=legs))


@pytest.fixture(scope="module")
def pose(still):
    return still.pose[0][0], still.pose[1][0]


def corner(at, outwards, clamped=None, allowance=0.0):
    """A tetrahedron with its corner at a point, outwards from there; clamped: the placement's inverse."""
    side = np.linalg.svd(outwards[None])[2][1:]
    foot = at + 0.01 * outwards
    points = np.array([at, *(foot + 0.001 * s for s in (side[0], side[1], -side[0] - side[1]))])
    points = points if clamped is None else clamped.apply(points)
    facets = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    mesh = Mesh.of(points, facets)
    return Obstacle("part" if clamped else "fixture", MeshDistance.of(mesh), clamped is not None, allowance=allowance)


def judged(replay, obstacle=None, tool=()):
    collision_world = CollisionWorld(() if obstacle is None else (obstacle,), tool)
    return {claim.name: claim(replay) for claim in claims(collision_world, 5)}


def across(direction):
    side = np.cross(direction, [1.0, 0.0, 0.0])
    return side / np.linalg.norm(side)


@pytest.mark.parametrize("leg", range(5))
@pytest.mark.parametrize("gap", [3e-3, 2e-2])
def test_a_corner_beside_a_leg(still, pose, leg, gap):
    machine, (position, direction) = still.machine, pose
    base = np.append(machine.robot.base[leg], 0.0)
    joint = position + machine.robot.offsets[leg] * direction
    out = across((joint - base) / np.linalg.norm(joint - base))
    at = base + 0.3 * (joint - base) + (machine.bodies.leg_radius + gap) * out
    found = judged(still, corner(at, out))["legs clear of the fixture"]
    assert found.value == pytest.approx(1e3 * gap, rel=1e-5)
    assert (found.passed, found.bound, found.unit) == (True, 0.0, "mm")
    assert found.method.startswith(f"leg {leg + 1} comes closest; exact distance")


@pytest.mark.parametrize("gap", [-2e-3, 3e-3, 2e-2])
def test_a_corner_beside_the_spindle(still, pose, gap):
    machine, (position, direction) = still.machine, pose
    out = across(direction)
    nose = machine.tool_length - machine.bodies.shaft_end
    at = position + (nose - 0.01) * direction + (machine.bodies.shaft_radius + gap) * out
    found = judged(still, corner(at, out))["spindle clear of the fixture"]
    assert found.value == pytest.approx(1e3 * gap, rel=1e-5)
    assert found.passed == (gap > 0.0)
    assert ("is in the fixture; exact at this moment" in found.method) == (gap < 0.0)


@pytest.mark.parametrize(("gap", "passed"), [(3e-3, True), (-4e-5, True), (-6e-5, False)])
def test_a_corner_of_the_part_beside_the_holder(still, pose, gap, passed):
    """Of the tool's body a part allows what it counts as no gouge."""
    machine, (position, direction) = still.machine, pose
    out = across(direction)
    at = position + (machine.tool_length - 0.04) * direction + (HOLDER.low_radius + gap) * out
    part = corner(at, out, still.program.placement.inverse(), allowance=5e-5)
    found = judged(still, part, (SHANK, HOLDER))["tool body clear of the part"]
    # A lower bound, as sharp as the distance of tools is: its resolution, and 1 % of a depth.
    least = 1e3 * (gap - TOOL_RESOLUTION_M + 0.01 * min(gap, 0.0))
    assert least - 1e-6 <= found.value <= 1e3 * gap + 1e-6
    assert found.bound == pytest.approx(-0.05, rel=1e-9)
    assert found.passed is passed


def test_gaps_that_are_far_are_named_as_far(still, pose):
    away = np.array([0.0, 0.0, 3.0])
    found = judged(still, corner(pose[0] + away, np.array([0.0, 0.0, 1.0])), (SHANK, HOLDER))
    for name, most in (("legs", 100.0), ("spindle", 100.0), ("tool body", 10.0)):
        certificate = found[f"{name} clear of the fixture"]
        assert certificate.passed
        assert certificate.value == pytest.approx(most, rel=1e-5)
        assert f"distances were computed up to {most:g} mm" in certificate.method
    near = judged(still, corner(pose[0] + 0.1 * away, np.array([0.0, 0.0, 1.0])))["spindle clear of the fixture"]
    assert near.passed


def test_legs_and_holder_of_a_machine_that_stands(still, pose):
    """Against a search for the nearest points of leg and holder."""
    machine, (position, direction) = still.machine, pose
    high = machine.tool_length - machine.robot.offsets.max() - 0.02
    holder = Solid("holder", 0.5 * high, high, 0.02, 0.02)
    found = judged(still, tool=(holder,))["legs clear of the tool body"]
    side = np.linalg.svd(direction[None])[2][1:]
    gaps = []
    for k in range(5):
        start, joint = np.append(machine.robot.base[k], 0.0), position + machine.robot.offsets[k] * direction

        def apart(x, start=start, joint=joint):
            height, radius, turn, share = x
            shell = position + (machine.tool_length - height) * direction
            shell = shell + radius * (np.cos(turn) * side[0] + np.sin(turn) * side[1])
            return np.linalg.norm(shell - start - share * (joint - start))

        box = [(holder.low, holder.high), (0.0, holder.low_radius), (-7.0, 7.0), (0.0, 1.0)]
        tries = [minimize(apart, [high, 0.01, turn, 0.9], bounds=box).fun for turn in (-2.0, 0.0, 2.0)]
        gaps.append(min(tries) - machine.bodies.leg_radius)
    assert found.value == pytest.approx(1e3 * min(gaps), rel=2e-4)
    assert found.method.startswith(f"leg {1 + int(np.argmin(gaps))} comes closest; ")
    assert (found.passed, found.bound) == (True, 0.0)


def test_displacements_of_bodies_follow_from_points_of_the_line(still):
    machine = still.machine
    cone = Solid("holder", 0.03, 0.07, 8e-3, 9e-3, rounding=1e-3)
    offsets = line_offsets(machine, (SHANK, cone))
    np.testing.assert_allclose(offsets[:5], machine.robot.offsets)
    ends = machine.tool_length - np.array([0.07, 0.006])
    np.testing.assert_allclose(np.sort(offsets[7:]), ends)
    np.testing.assert_allclose(offsets[5:7], line_offsets(machine, ())[5:])
    assert len(line_offsets(machine, ())) == 7
    moved = Displacement(np.array([[1.0, 2.0, 3.0, 4.0, 5.0, 7.0, 6.0, 8.0, 9.0]]), np.array([0.5]))
    np.testing.assert_allclose(body_displacements(moved, (SHANK, cone), 5), [[1, 2, 3, 4, 5, 7, 9 + 0.5 * 0.010]])
    without = Displacement(moved.points[:, :7], moved.turn)
    np.testing.assert_allclose(body_displacements(without, (), 5), [[1, 2, 3, 4, 5, 7]])


@pytest.mark.parametrize("size", [1, 4])
def test_travels_are_the_longer_of_both_ways_from_the_middle_of_each_stretch(size):
    """Of so many stretches that they are summed in parts, not all side by side, the last one cut short."""
    rng, count = np.random.default_rng(size), 20_002
    speeds = rng.uniform(0.0, 0.1, (2 * count, 3))
    path, samples = cases.toolpath_of(cases.strokes()[:1]), cases.along_x(np.arange(2 * count + 1))
    replay = cases.measured(path, samples, legs=np.full((count + 1, 5), 0.7), bounds={"speeds": speeds})
    starts = np.arange(0, count, size)
    starts = np.append(starts[:-1][rng.uniform(size=len(starts) - 1) < 0.9], starts[-1])
    tip = replay.machine.tool_length
    found = travels(replay, starts, size, np.array([tip]))
    for k in [0, 1, *rng.integers(0, len(starts), 200), len(starts) - 1]:
        start, end = starts[k], min(starts[k] + size, count)
        ways = speeds[2 * start : start + end, 0], speeds[start + end : 2 * end, 0]
        assert found.points[k, 0] == pytest.approx(0.5 * cases.PERIOD * max(way.sum() for way in ways), rel=1e-8)


# The search for the smallest gap, on a replay whose gaps are given.


def searched(gaps, moved, monkeypatch, **bound):
    """The clearance bound of gaps (M,) at the samples, where nothing moves by more than `moved` in a row's time."""
    gaps = np.asarray(gaps).reshape(len(gaps), -1)
    count = (len(gaps) - 1) // 2
    asked = []

    def displaced(_replay, starts, size, _offsets, _options):
        # From the middle of a stretch, at most half of it away.
        asked.append((starts.copy(), size))
        return Displacement(np.full((len(starts), gaps.shape[1]), 0.5 * size * moved), np.zeros(len(starts)))

    def travelled(_replay, starts, size, _offsets):
        return Displacement(np.full((len(starts), gaps.shape[1]), size * moved), np.zeros(len(starts)))

    monkeypatch.setattr("pentapod.verify.replay.clearance_bounds.displacements", displaced)
    monkeypatch.setattr("pentapod.verify.replay.clearance_bounds.travels", travelled)
    path = cases.toolpath_of(cases.strokes()[:1])
    replay = cases.measured(path, cases.along_x(np.arange(2 * count + 1)), legs=np.full((count + 1, 5), 0.7))

    def given(poses, far):
        return np.minimum(gaps[np.round(poses[0][:, 0]).astype(int)], far)

    found = clearance_bound(replay, given, lambda by: by.points, np.zeros(1), **bound)
    return found, asked


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("count", [1, 5, 64, 65, 700])
def test_the_smallest_gap_is_found_wherever_it_is(count, seed, monkeypatch):
    """Gaps that change by no more than they can: what is proven is below the least of all, and not far."""
    rng, moved = np.random.default_rng(seed), 1e-4
    gaps = 5e-3 + np.cumsum(rng.uniform(-0.5, 0.5, 2 * count + 1)) * moved
    gaps -= gaps.min() - 4e-4
    found, asked = searched(gaps, moved, monkeypatch)
    assert found.proven
    assert found.gap <= gaps.min()
    # Not improved on within the larger of 20 µm and 30 %, but for the last step: from the middle of one row to another.
    assert found.gap >= gaps.min() - max(2e-5, 0.3 * 4e-4) - 0.5 * moved
    # What no way from the middle can use up is not enclosed; of what is looked at closely, no row is left out.
    first, size = asked[0]
    middles = np.arange(0, count, size) + np.minimum(np.arange(0, count, size) + size, count)
    close = gaps[middles] - size * moved < gaps.min()
    assert set(np.arange(0, count, size)[close]) <= set(first.tolist())
    assert {start % size for start in first.tolist()} == {0}


def test_a_search_ends_where_a_gap_is_met(monkeypatch):
    gaps = np.full(401, 1e-3)
    gaps[64] = -1e-5
    found, asked = searched(gaps, 1e-7, monkeypatch)
    assert (found.gap, found.sample, found.proven) == (-1e-5, 64, True)
    assert asked == []
    other = np.stack([np.full(401, 2e-3), gaps, np.full(401, 3e-3)], axis=1)
    found, asked = searched(other, 1e-7, monkeypatch)
    assert (found.gap, found.column, found.sample, found.proven) == (-1e-5, 1, 64, True)
    found, _ = searched(gaps, 1e-7, monkeypatch, bound=-2e-5)
    assert found.gap == pytest.approx(-1e-5, abs=1e-5)
    assert found.gap > -2e-5


def along_a_wall(gap, interpolation):
    """The claim on a shank of 4 mm that moves along a flat wall `gap` metres away, and may be 50 µm inside."""
    up = np.array([0.0, 0.0, 1.0])
    parts = [cases.straight(SegmentKind.CUT, cases.FEED, [-4e-3, 0.0, 0.0], [4e-3, 0.0, 0.0], up, count=9)]
    program = cases.program_of(cases.STAND, *cases.timed(parts), interpolation=interpolation)
    y = SHANK.low_radius + gap
    mesh = Mesh.of(np.array([[-0.02, y, 0.0], [0.02, y, 0.0], [0.0, y, 0.02]]), np.array([[0, 1, 2]]))
    wall = Obstacle("part", MeshDistance.of(mesh), clamped=True, allowance=50e-6)
    replay = cases.replay_of(cases.good_case(interpolation=interpolation), program, cases.toolpath_of(parts))
    return judged(replay, wall, (SHANK,))["tool body clear of the part"]


@pytest.mark.parametrize("interpolation", [pytest.param("linear", marks=pytest.mark.slow), "cubic"])
@pytest.mark.parametrize("short", [20e-6, 5e-6, pytest.param(2e-6, marks=pytest.mark.slow)])
def test_a_gap_along_a_wall_is_proven_though_the_tool_moves_far_in_a_period(short, interpolation):
    """At the feed the tool moves by 30 µm in a period."""
    found = along_a_wall(-50e-6 + short, interpolation)
    assert found.passed
    assert found.value == pytest.approx(-0.05 + 1e3 * short, abs=1e3 * short)


def test_a_shank_deeper_in_a_wall_than_allowed_is_found():
    found = along_a_wall(-52e-6, "cubic")
    assert not found.passed
    assert found.value == pytest.approx(-0.052, abs=2e-3)


class Recording(LinearPentapod):
    """A robot that keeps what it was asked to enclose."""

    def enclose(self, ends, lengths, offsets):
        self.__dict__["seen"] = [*self.__dict__.get("seen", []), (ends, lengths, offsets)]
        return np.ones((2, 1)), np.zeros(2)


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
def test_stretches_are_enclosed_from_their_middle_by_all_their_legs(cubic, interpolation):
    """Seventy rows: two stretches of up to 64 intervals, the second one of five; the hull of each is of its curve."""
    legs, lean, robot = cubic.program.legs[200:270], 1e-3 * np.arange(139), cases.STAND.robot
    recording = Recording.quadratic(robot.base, robot.delta)
    replay = cases.measured(
        cases.toolpath_of(cases.strokes()[:1]),
        cases.along_x(np.arange(139)),
        np.stack([0.0 * lean, np.sin(lean), np.cos(lean)], axis=1),
        machine=replace(cases.STAND, robot=recording),
        legs=legs,
        interpolation=interpolation,
    )

    found = displacements(replay, np.array([0, 64]), 64, np.zeros(1))
    assert (found.points.tolist(), found.turn.tolist()) == ([[1.0], [1.0]], [0.0, 0.0])
    (((position, direction), lengths, offsets),) = recording.__dict__["seen"]
    np.testing.assert_allclose(position[:, 0], [64.0, 133.0])
    np.testing.assert_allclose(direction[:, 1], -np.sin([0.064, 0.133]))
    assert offsets.tolist() == [0.0]
    curve = CubicSpline(np.arange(70), legs, bc_type="clamped")
    for own, (first, last) in zip(lengths, ((0, 64), (64, 69)), strict=True):
        if interpolation == "linear":
            assert {tuple(row) for row in own} == {tuple(row) for row in legs[first : last + 1]}
            continue
        ends = {tuple(np.round(row, 10)) for row in own}
        assert ends >= {tuple(np.round(row, 10)) for row in legs[first : last + 1]}
        thirds = [legs[k] + curve(k, 1) / 3.0 for k in range(first, last)]
        thirds += [legs[k] - curve(k, 1) / 3.0 for k in range(first + 1, last + 1)]
        assert ends == {tuple(np.round(row, 10)) for row in [*legs[first : last + 1], *thirds]}


def test_a_motion_of_which_nothing_is_known_is_not_proven(monkeypatch):
    found, _ = searched(np.full(401, 1e-3), np.inf, monkeypatch)
    assert (found.gap, found.proven) == (-np.inf, False)


def test_the_clearance_of_a_machine_that_stands_is_that_of_its_rows(still, pose):
    from pentapod.machine import clearances

    found = clearance(still)
    least = clearances(still.machine, pose[0][None], pose[1][None]).min()
    assert found.value == pytest.approx(1e3 * least, rel=1e-6)
    assert (found.passed, found.bound, found.unit, found.where.row) == (True, 0.0, "mm", 0)


@pytest.mark.parametrize("rows", [4973, 1000, 33, 17])
def test_what_is_not_looked_into_is_not_the_closest(cubic, rows):
    """Against all samples, each less the way to the next that any point can go meanwhile."""
    from pentapod.machine import clearances

    program = replace(cubic.program, legs=cubic.program.legs[:rows])
    replay = cases.replay_of(cubic, program)
    ways = 0.5 * cases.PERIOD * replay.interval_bounds.speeds.max(axis=1)
    gaps = clearances(cubic.machine, *replay.pose) - np.maximum([0.0, *ways], [*ways, 0.0])[:, None]
    found = clearance(replay)
    assert found.value == pytest.approx(1e3 * gaps.min(), rel=1e-9)
    assert found.where.row == int(gaps.min(axis=1).argmin()) // 2
    assert found.method.startswith(pair_names(cubic.machine)[int(gaps.min(axis=0).argmin())])


def test_a_machine_within_something_is_inside_it(still, pose):
    """Nothing of its surface comes near: the corners of a tetrahedron of ten metres."""
    points = np.array([[0.0, 0.0, 10.0], [10.0, 0.0, -5.0], [-5.0, 9.0, -5.0], [-5.0, -9.0, -5.0]]) + pose[0]
    mesh = Mesh.of(points, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]))
    around = Obstacle("fixture", MeshDistance.of(mesh), clamped=False, allowance=2e-3)
    found = judged(still, around, (SHANK, HOLDER))
    for name in ("legs", "spindle", "tool body"):
        certificate = found[f"{name} clear of the fixture"]
        assert (certificate.passed, certificate.value, certificate.unit) == (False, None, "mm")
        assert certificate.bound == pytest.approx(-2.0 if name == "tool body" else 0.0)
        assert certificate.method.endswith(" is inside the fixture")
        assert (certificate.where.row, certificate.where.time_s) == (0, 0.0)
