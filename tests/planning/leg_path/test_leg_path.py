"""LegPath: true to inverse kinematics, over the tip's arc length, within tolerance, resting where it must."""

import re
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from pentapod.base.errors import ToolpathError
from pentapod.base.refusal import Refusal
from pentapod.geometry.directions import angle_between
from pentapod.geometry.rigid import RigidTransform
from pentapod.geometry.solids import Solid
from pentapod.kinematics.component import Component
from pentapod.machine.clearance.collision_world import CollisionWorld, Obstacle
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.planning.leg_path.leg_path import LegPath, leg_path
from pentapod.planning.leg_path.tolerances import tolerances_beside
from pentapod.planning.leg_path.tool_curve import ToolCurve
from pentapod.planning.placement.placed_path import PlacedPath, Placement
from pentapod.timing import Trajectory, retime
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

TOLERANCE, AXIS_TOLERANCE = 20e-6, np.radians(0.1)


def placed_on(machine, toolpath):
    """The toolpath with its nominal axes, its origin in the middle of the work volume, z up towards the base."""
    turn = RigidTransform(np.diag([1.0, -1.0, -1.0]), machine.work.centre)
    axes = turn.rotate(toolpath.axes)
    tips = turn.apply(toolpath.tips)
    margins, limits = np.ones((len(tips), 1)), ()
    return PlacedPath(toolpath, Placement(turn, "test"), Component(1, 1), tips, axes, margins, limits)


def fan(points, lean):
    axes = np.c_[lean, np.zeros(len(lean)), np.ones(len(lean))]
    return np.asarray(points, dtype=float), axes / np.linalg.norm(axes, axis=1, keepdims=True)


@pytest.fixture(scope="module")
def mixed(desk):
    """Rapid down, a cut round two corners while the axis turns, rapid up."""
    up = np.array([0.0, 0.0, 0.02])
    x = np.linspace(0.0, 0.05, 26)
    side = np.c_[np.full(2, 0.05), [0.002, 0.004], np.zeros(2)]
    cut = np.concatenate([np.c_[x, 0 * x, 0 * x], side, np.c_[x[::-1], 0 * x + 0.006, 0 * x]])
    tips, axes = fan(cut, 0.2 * np.sin(np.linspace(0.0, 2.0, len(cut))))
    segments = (
        Segment(SegmentKind.RAPID, np.stack([tips[0] + up, tips[0] + 0.2 * up]), axes[[0, 0]], np.inf),
        Segment(SegmentKind.LINK, np.stack([tips[0] + 0.2 * up, tips[0]]), axes[[0, 0]], 0.01),
        Segment(SegmentKind.CUT, tips, axes, 0.02),
        Segment(SegmentKind.LINK, np.stack([tips[-1], tips[-1] + 0.2 * up]), axes[[-1, -1]], 0.01),
        Segment(SegmentKind.RAPID, np.stack([tips[-1] + 0.2 * up, tips[-1] + up]), axes[[-1, -1]], np.inf),
    )
    placed = placed_on(desk, Toolpath(segments, 0.003))
    path = leg_path(placed, desk, path_tolerance=TOLERANCE, axis_tolerance=AXIS_TOLERANCE)
    assert isinstance(path, LegPath)
    return placed, path


def test_legs_are_the_inverse_kinematics_of_the_pose(desk, mixed):
    _, path = mixed
    s = np.linspace(0.0, path.length, 3001)
    tips, axes = path.pose(s)
    expected = desk.robot.leg_lengths(tips + desk.tool_length * axes, -axes)
    np.testing.assert_allclose(path(s), expected, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(axes, axis=1), 1.0, atol=1e-14)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_by_finite_differences_inside_each_span(mixed, order):
    _, path = mixed
    for piece in path.pieces:
        knots = piece.knots
        wide = np.diff(knots) > 1e-4
        s = (0.5 * (knots[:-1] + knots[1:]))[wide]
        h = 1e-2 * np.diff(knots)[wide]
        up, down = piece(s + h, order - 1), piece(s - h, order - 1)
        up2, down2 = piece(s + 2 * h, order - 1), piece(s - 2 * h, order - 1)
        fd = (8.0 * (up - down) - (up2 - down2)) / (12.0 * h[:, None])
        np.testing.assert_allclose(piece(s, order), fd, rtol=2e-5, atol=2e-5)


def test_parameter_is_the_arc_length_of_the_tip(mixed):
    _, path = mixed
    for piece in path.pieces:
        s = np.linspace(0.0, piece.length, 500)
        speed = np.linalg.norm(piece.pose(s, 1)[0], axis=1)
        assert speed.max() <= 1.0 + 1e-6
        assert speed.min() >= 1.0 - 1e-3  # what the lever of the axis takes

        def rate(x, piece=piece):
            return float(np.linalg.norm(piece.pose(np.array([x]), 1)[0]))

        measured, _ = quad(rate, 0.0, piece.length, limit=400, points=piece.knots[1:-1:3][:100])
        assert measured == pytest.approx(piece.length, rel=1e-4)


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_legs_are_c3_across_knots(mixed, order):
    """Jumps at the knots shrink with the step across them, up to the third derivative."""
    _, path = mixed
    for piece in path.pieces:
        knots = piece.knots[1:-1]
        if len(knots) == 0:
            continue
        h = 1e-4 * np.minimum(np.diff(piece.knots)[:-1], np.diff(piece.knots)[1:])
        jump = np.abs(piece(knots + h, order) - piece(knots - h, order)).max(axis=1)
        change = np.abs(piece(knots, order)).max()
        assert (jump <= 5e-3 * max(change, 1e-9)).all()


def test_all_derivatives_at_once_are_those_one_by_one(mixed):
    _, path = mixed
    piece = path.pieces[1]
    s = np.linspace(0.0, piece.length, 100)
    for order, values in enumerate(piece.derivatives(s, 3)):
        np.testing.assert_array_equal(values, piece(s, order))


def test_waypoints_have_stations(mixed):
    placed, path = mixed
    seen = np.concatenate([piece.waypoints for piece in path.pieces])
    assert set(seen) == set(range(len(placed.toolpath)))
    for piece in path.pieces:
        assert len(piece.waypoints) == len(piece.waypoint_stations)
        assert piece.waypoint_stations[[0, -1]] == pytest.approx([0.0, piece.length], abs=1e-15)
        tips, axes = piece.pose(piece.waypoint_stations)
        tilt_centres = tips + placed.toolpath.tilt_centre * axes
        assert np.linalg.norm(tilt_centres - placed.tilt_centres[piece.waypoints], axis=1).max() <= TOLERANCE


def test_tilt_centre_and_axis_stay_within_their_tolerances(mixed):
    placed, path = mixed
    s = np.linspace(0.0, path.length, 20_000)
    tips, axes = path.pose(s)
    tilt_centres = tips + placed.toolpath.tilt_centre * axes
    a, b = placed.tilt_centres[:-1], placed.tilt_centres[1:]
    share = np.einsum("nkj,kj->nk", tilt_centres[:, None] - a, b - a) / np.maximum(np.square(b - a).sum(axis=1), 1e-30)
    foot = a + np.clip(share, 0.0, 1.0)[..., None] * (b - a)
    distance = np.linalg.norm(tilt_centres[:, None] - foot, axis=2)
    assert distance.min(axis=1).max() <= TOLERANCE
    assert distance.min(axis=1).max() >= 0.3 * TOLERANCE  # corners use the tolerance: else needlessly slow
    nearest = distance.argmin(axis=1)
    either = np.minimum(angle_between(axes, placed.axes[nearest]), angle_between(axes, placed.axes[nearest + 1]))
    assert either.max() <= AXIS_TOLERANCE + angle_between(placed.axes[:-1], placed.axes[1:]).max()


def test_it_rests_between_rapids_and_feeds_and_nowhere_else(mixed):
    _, path = mixed
    assert [set(piece.section_kinds) for piece in path.pieces] == [
        {SegmentKind.RAPID},
        {SegmentKind.LINK, SegmentKind.CUT},
        {SegmentKind.RAPID},
    ]
    for piece in path.pieces:
        assert piece.section_ends[-1] == pytest.approx(piece.length, abs=1e-15)
        assert (np.diff(piece.section_ends) > 0).all()
    assert list(path.pieces[1].section_segments) == [1, 2, 3]
    assert path.pieces[1].section_ends[0] == pytest.approx(0.004, abs=1e-4)


def test_a_turn_on_the_spot_that_sends_the_tip_back_stops(desk):
    """The tilt centre stands while the axis turns, and the tip reverses although the tilt centre's path has no sharp
    corner."""
    tips, axes = fan([[0, 0, 0], [0.02, 0, 0], [0.02, 0, 0], [0.02, 0.02, 0]], [0.0, 0.0, 0.2, 0.2])
    tilt_centre = 0.003
    toolpath = Toolpath((Segment(SegmentKind.CUT, tips - tilt_centre * axes, axes, 0.01),), tilt_centre)
    path = leg_path(placed_on(desk, toolpath), desk, path_tolerance=TOLERANCE, axis_tolerance=AXIS_TOLERANCE)
    assert isinstance(path, LegPath)
    assert len(path.pieces) == 2
    speed = np.linalg.norm(path.pieces[1].pose(np.linspace(0.0, path.pieces[1].length, 999), 1)[0], axis=1)
    assert speed.min() > 0.3


def test_pieces_join(mixed):
    _, path = mixed
    for a, b in zip(path.pieces, path.pieces[1:], strict=False):
        np.testing.assert_allclose(a(np.array([a.length])), b(np.zeros(1)), atol=1e-14)


def test_turning_on_the_spot_has_length(desk):
    tips, axes = fan([[0.0, 0, 0]] * 5, np.linspace(0.0, 0.2, 5))
    path = leg_path(
        placed_on(desk, Toolpath((Segment(SegmentKind.CUT, tips, axes, 0.01),))),
        desk,
        path_tolerance=TOLERANCE,
        axis_tolerance=AXIS_TOLERANCE,
    )
    assert isinstance(path, LegPath)
    assert path.length == pytest.approx(1e-3 * np.arctan(0.2), rel=1e-3)
    np.testing.assert_allclose(path.pose([path.length])[1][0] * [1, -1, -1], axes[-1], atol=1e-12)


def test_the_way_of_the_tip_alone_is_kept(desk):
    """Half way with the axis turning as the tip moves, then turning on the spot: against scipy's quadrature."""
    tips, axes = fan([[0, 0, 0], [0.002, 0, 0], [0.004, 0, 0], [0.004, 0, 0]], [0.0, 0.3, 0.1, 0.4])
    toolpath = Toolpath((Segment(SegmentKind.CUT, tips, axes, 0.01),))
    path = leg_path(placed_on(desk, toolpath), desk, path_tolerance=TOLERANCE, axis_tolerance=AXIS_TOLERANCE)
    assert isinstance(path, LegPath)
    (piece,) = path.pieces
    s = np.linspace(0.0, piece.length, 300)
    way = piece.tip_length(s)
    assert way[0] == 0.0
    assert (np.diff(way) >= -1e-15).all()
    fine = piece.pose(np.linspace(0.0, piece.length, 400_001))[0]
    expected = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
    np.testing.assert_allclose(way, np.interp(s, np.linspace(0.0, piece.length, 400_001), expected), atol=2e-9)
    assert way[-1] < piece.length - 1e-4  # the turn on the spot


def test_the_tilt_centres_way_is_its_derivative(mixed):
    placed, path = mixed
    s = np.linspace(0.001, path.length - 0.001, 400)
    h = 1e-7

    def tilt_centres(at):
        tips, axes = path.pose(at)
        return tips + placed.toolpath.tilt_centre * axes

    inside = np.abs(s[:, None] - path.starts).min(axis=1) > 1e-5
    fd = np.linalg.norm(tilt_centres(s + h) - tilt_centres(s - h), axis=1) / (2 * h)
    np.testing.assert_allclose(path.surface_rate(s)[inside], fd[inside], rtol=1e-5)


def test_a_ball_that_rolls_over_an_edge_does_not_stop(desk):
    """Its tip is kept on the edge and goes to and fro by micrometres, which is no corner of the motion."""
    angles = np.concatenate([np.zeros(3), np.linspace(0.0, 0.5, 12), np.full(3, 0.5)])
    _, axes = fan(np.zeros((len(angles), 3)), angles)
    along = np.concatenate([np.linspace(-0.01, -0.002, 3), np.zeros(12), np.linspace(0.002, 0.01, 3)])
    tips = along[:, None] * np.cross([0.0, 1.0, 0.0], axes)
    tips[3:15, 0] += 2e-6 * (-1.0) ** np.arange(12)
    toolpath = Toolpath((Segment(SegmentKind.CUT, tips, axes, 0.01),), 0.003)
    path = leg_path(placed_on(desk, toolpath), desk, path_tolerance=TOLERANCE, axis_tolerance=AXIS_TOLERANCE)
    assert isinstance(path, LegPath)
    assert len(path.pieces) == 1
    # Its length is known: 16 mm of the tip, beside which the turn counts little.
    assert 0.02 < path.length < 0.021


def test_a_sharp_reversal_stops(desk):
    tips, axes = fan([[0, 0, 0], [0.03, 0, 0], [0.0, 0.002, 0]], np.zeros(3))
    toolpath = Toolpath((Segment(SegmentKind.CUT, tips, axes, 0.01),))
    path = leg_path(placed_on(desk, toolpath), desk, path_tolerance=TOLERANCE, axis_tolerance=AXIS_TOLERANCE)
    assert isinstance(path, LegPath)
    assert len(path.pieces) == 2


@pytest.mark.parametrize("width", [2e-10, 1e-9, 2.7e-9, 1e-7, 1e-6, 1.9e-6, 2e-6, 3e-6, 20e-6])
@pytest.mark.parametrize("tilt_centre", [0.0, 0.003])
def test_a_reversal_over_a_short_way_is_one_corner(desk, width, tilt_centre):
    """No waypoint of it turns by more than a right angle. The curve bent in nanometres: no time law was found."""
    tips, axes = fan([[0, 0, 0], [0.01, 0, 0], [0.01, width, 0], [0.0, width, 0]], np.zeros(4))
    toolpath = Toolpath((Segment(SegmentKind.CUT, tips, axes, 0.01),), tilt_centre)
    path = leg_path(placed_on(desk, toolpath), desk, path_tolerance=20e-6, axis_tolerance=AXIS_TOLERANCE)
    assert isinstance(path, LegPath)
    assert len(path.pieces) == (1 if width > 0.1 * 20e-6 else 2)
    trajectory = retime(path, desk)
    assert isinstance(trajectory, Trajectory)
    assert trajectory.duration < 1.02 * 2 * (0.01 / 0.01 + 0.01)


def test_a_path_that_turns_back_right_beside_a_stop_is_known(desk):
    """No waypoint of it turns sharply, and there is a stop already: the curve bent in nanometres beside it."""
    points = [[0, 0, 0], [1.8e-6, 0, 0], [1.8e-6, 1e-8, 0], [-0.02, 1e-8, 0]]
    tips, axes = fan(points, np.zeros(4))
    rapid = Segment(SegmentKind.RAPID, *fan([[0, 0, 0.005], [0, 0, 0]], np.zeros(2)), np.inf)
    toolpath = Toolpath((rapid, Segment(SegmentKind.CUT, tips, axes, 0.01)), 0.002)
    path = leg_path(placed_on(desk, toolpath), desk, path_tolerance=20e-6, axis_tolerance=AXIS_TOLERANCE)
    assert isinstance(path, LegPath)
    assert [piece.length for piece in path.pieces] == pytest.approx([0.005, 0.02], abs=4e-6)
    assert isinstance(retime(path, desk), Trajectory)


def test_duplicate_waypoints_are_passed_over(desk):
    tips, axes = fan([[0, 0, 0], [0.01, 0, 0], [0.01, 0, 0], [0.03, 0, 0]], np.zeros(4))
    toolpath = Toolpath((Segment(SegmentKind.CUT, tips, axes, 0.01),))
    path = leg_path(placed_on(desk, toolpath), desk, path_tolerance=TOLERANCE, axis_tolerance=AXIS_TOLERANCE)
    assert isinstance(path, LegPath)
    assert path.length == pytest.approx(0.03, rel=1e-12)


def test_a_path_that_does_not_move_is_refused(desk):
    tips, axes = fan([[0, 0, 0], [0, 0, 0]], np.zeros(2))
    placed = placed_on(desk, Toolpath((Segment(SegmentKind.CUT, tips, axes, 0.01),)))
    answer = leg_path(placed, desk, path_tolerance=TOLERANCE, axis_tolerance=AXIS_TOLERANCE)
    assert isinstance(answer, Refusal)
    assert "does not move" in answer.cause


def test_a_path_that_bends_too_sharply_is_refused(desk, mixed, monkeypatch):
    """No path is known that needs more than a few halvings: none are allowed here."""
    monkeypatch.setattr(sys.modules[ToolCurve.__module__], "HALVINGS", 0)
    answer = leg_path(mixed[0], desk, path_tolerance=TOLERANCE, axis_tolerance=AXIS_TOLERANCE)
    assert isinstance(answer, Refusal)
    assert re.search(r"bends too sharply .*, between waypoints 0 and \d+$", answer.cause)
    assert "tolerance.path_mm" in answer.remedy


@pytest.mark.parametrize("bad", [0.0, -1e-6, np.nan])
def test_tolerances_must_be_positive(desk, mixed, bad):
    with pytest.raises(ToolpathError, match="path_tolerance"):
        leg_path(mixed[0], desk, path_tolerance=bad, axis_tolerance=AXIS_TOLERANCE)


def test_stops_and_dwells_where_the_toolpath_asks(desk, mixed):
    """The path goes exactly through these waypoints, which no rounding of corners would let it."""
    placed, free = mixed
    toolpath = placed.toolpath
    cut = toolpath.segments[2]
    halves = (
        replace(cut, tips=cut.tips[:26], axes=cut.axes[:26], dwell=0.0),
        replace(cut, tips=cut.tips[25:], axes=cut.axes[25:]),
    )
    last = replace(toolpath.segments[-1], dwell=2.0)
    asked = replace(toolpath, segments=(*toolpath.segments[:2], *halves, toolpath.segments[3], last), wait=0.25)
    path = leg_path(placed_on(desk, asked), desk, path_tolerance=TOLERANCE, axis_tolerance=AXIS_TOLERANCE)
    assert isinstance(path, LegPath)
    assert len(path.pieces) == len(free.pieces) + 1
    assert path.dwells.tolist() == [0.25, *[0.0] * (len(path.pieces) - 1), 2.0]
    corner = placed.tips[toolpath.starts[2] + 25]
    at = [
        np.linalg.norm(path.pose(path.starts)[0] - corner, axis=1).min(),
        np.linalg.norm(free.pose(np.linspace(0, free.length, 20_001))[0] - corner, axis=1).min(),
    ]
    assert at[0] < 1e-9
    assert at[1] > 1e-6


def test_stops_at_corners_as_sharp_as_asked(desk, mixed):
    placed, free = mixed
    path = leg_path(placed, desk, path_tolerance=TOLERANCE, axis_tolerance=AXIS_TOLERANCE, stop_angle=np.radians(80.0))
    assert isinstance(path, LegPath)
    assert len(path.pieces) == len(free.pieces) + 4  # two corners of the cut, and where links lead into it and out
    assert not path.dwells.any()


def tip_deviations(path, points):
    """Largest deviation of a path from a polyline (N, 3) in the machine, within a millimetre of each of its points."""
    tips = path.pose(np.linspace(0.0, path.length, 20001))[0]
    step = np.diff(points, axis=0)
    share = np.einsum("kj,nkj->nk", step, tips[:, None] - points[:-1]) / np.einsum("kj,kj->k", step, step)
    off = np.linalg.norm(tips[:, None] - points[:-1] - np.clip(share, 0.0, 1.0)[..., None] * step, axis=2).min(axis=1)
    return np.array([off[np.linalg.norm(tips - point, axis=1) < 1e-3].max() for point in points])


def zigzag(desk):
    """Five teeth of 5 mm, and the axis upright."""
    tips = np.c_[5e-3 * np.arange(11), 5e-3 * (np.arange(11) % 2), np.zeros(11)]
    up = np.tile([0.0, 0.0, 1.0], (11, 1))
    return placed_on(desk, Toolpath((Segment(SegmentKind.CUT, tips, up, 0.02),), 0.003))


def test_tolerances_at_the_waypoints_hold_around_them(desk):
    placed = zigzag(desk)
    everywhere = np.full(11, TOLERANCE)
    tight = np.where(np.arange(11) == 5, 0.1, 1.0) * everywhere
    one, same, other = (
        leg_path(placed, desk, path_tolerance=each, axis_tolerance=AXIS_TOLERANCE)
        for each in (TOLERANCE, everywhere, tight)
    )
    np.testing.assert_array_equal(one(np.linspace(0.0, one.length, 999)), same(np.linspace(0.0, one.length, 999)))
    before, after = tip_deviations(one, placed.tips), tip_deviations(other, placed.tips)
    assert before[1:-1].min() > 0.2 * TOLERANCE
    assert after[5] <= 0.1 * TOLERANCE
    assert after[[1, 2, 8, 9]].min() > 0.2 * TOLERANCE


def beside_a_wall(desk, gap, wide=True):
    """The zigzag, a shank of 4 mm whose side is `gap` from a wall that the teeth point to, and the tolerances there."""
    placed = zigzag(desk)
    y = 5e-3 + 2e-3 + gap
    corners = np.array([[-0.1, y, -0.01], [0.1, y, -0.01], [0.0, y, 0.02 if wide else -0.009]])
    wall = Obstacle("part", MeshDistance.of(Mesh.of(corners, np.array([[0, 1, 2]]))), clamped=True, allowance=50e-6)
    world = CollisionWorld((wall,), (Solid("shank", 0.006, 0.03, 2e-3, 2e-3),))
    return tolerances_beside(placed, world, TOLERANCE, AXIS_TOLERANCE)


@pytest.mark.parametrize("gap", [-35e-6, 0.0, 1e-2])
def test_a_motion_within_its_tolerances_keeps_the_shank_clear_of_a_wall(desk, gap):
    path, axis = beside_a_wall(desk, gap)
    near, far = np.arange(1, 10, 2), np.arange(0, 11, 2)
    rise = 0.02 - 0.003  # of the wall above the ball's centre
    room = gap + 50e-6
    assert (path[near] + rise * np.sin(axis[near]) < room).all()
    np.testing.assert_array_equal(path[far], TOLERANCE)
    np.testing.assert_array_equal(axis[far], AXIS_TOLERANCE)
    if gap > 1e-3:
        np.testing.assert_array_equal(path, TOLERANCE)
        np.testing.assert_array_equal(axis, AXIS_TOLERANCE)
    else:
        assert axis[near].max() < AXIS_TOLERANCE
    assert path.min() >= 0.05 * TOLERANCE


def test_an_axis_may_turn_where_the_obstacle_does_not_reach_up_to_the_shank(desk):
    _, axis = beside_a_wall(desk, -35e-6, wide=False)
    np.testing.assert_array_equal(axis, AXIS_TOLERANCE)
