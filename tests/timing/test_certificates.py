"""LimitUse: the largest share of each limit on the sampled program, against dense samples of scipy's splines."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, make_interp_spline
from timing_paths import Path, Piece, by_tip, line, machine, nodding, raster, straight

from pentapod.machine.parts import ToolLimits
from pentapod.timing import LimitUse, Trajectory, certify, retime
from pentapod.timing.limits.leg_jerk import LegJerk
from pentapod.timing.limits.leg_velocity import LegVelocity
from pentapod.toolpath.toolpath import SegmentKind


def timed(piece, m):
    trajectory = retime(Path((piece,)), m)
    assert isinstance(trajectory, Trajectory), str(trajectory)
    return trajectory


def limited(m, **tool):
    """The same machine for `certify`, with limits that the trajectory was not planned for."""
    return SimpleNamespace(**{**vars(m), "tool_limits": ToolLimits(**tool)})


def shares(uses):
    return {use.quantity: use for use in uses}


def test_limit_use_above_the_jerk_limit_says_why():
    use = LimitUse("leg jerk", 207.4, 200.0, "m/s³", 4, 8.387, 0.2, 7, LegJerk.above)
    assert str(use).startswith("leg jerk 103.70 % (leg 4: 207.4 of 200 m/s³) at 8.387 s, segment 7: the spline")
    assert str(replace(use, value=199.0)).endswith("segment 7")
    assert str(replace(use, quantity="leg velocity", above=LegVelocity.above)).endswith("segment 7")


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
def test_limit_uses_are_extrema_of_the_interpolation(interpolation):
    m = machine(interpolation=interpolation)
    trajectory = timed(raster(lines=3, feed=0.2), m)
    tool = {"max_tip_acceleration": 2.0, "max_tip_jerk": 70.0, "max_axis_velocity": 3.0, "max_axis_acceleration": 9.0}
    found = shares(certify(trajectory, limited(m, **tool)))
    t = np.arange(round(trajectory.duration / 1e-3) + 1) * 1e-3
    tips, axes = trajectory.pose(t)
    rows = np.column_stack([trajectory(t), trajectory.station(t), tips, axes])
    if interpolation == "cubic":
        spline = CubicSpline(t, rows, bc_type="clamped")
        dense = (t[:-1, None] + 1e-3 * np.linspace(0, 1, 21)).ravel()
        rates, pushes = np.abs(spline(dense, 1)), np.abs(spline(t, 2))
        jerks = np.abs(spline(t[:-1] + 5e-4, 3))
    else:
        rates = np.abs(make_interp_spline(t, rows, k=1)(t[:-1] + 5e-4, 1))
        steps = np.concatenate([0 * rows[:1], np.diff(rows, axis=0), 0 * rows[:1]])
        pushes = np.abs(np.diff(steps, axis=0)) / 1e-6
        jerks = np.abs(np.diff(steps, 2, axis=0)) / 1e-9
    assert found["leg velocity"].value == pytest.approx(rates[:, :5].max(), rel=1e-3)
    assert found["leg acceleration"].value == pytest.approx(pushes[:, :5].max(), rel=1e-6)
    assert found["leg jerk"].value >= jerks[:, :5].max() * (1 - 1e-6)
    assert found["feed"].value == pytest.approx(rates[:, 5].max(), rel=1e-3)
    # An upright axis: the turn of a beam that leans with the path is judged below, by rotations.
    assert found["axis velocity"].value == found["axis acceleration"].value == 0.0
    assert found["tip acceleration"].value == pytest.approx(np.linalg.norm(pushes[:, 6:9], axis=1).max(), rel=1e-6)
    assert found["tip jerk"].value >= np.linalg.norm(jerks[:, 6:9], axis=1).max() * (1 - 1e-6)
    assert max(found[name].share for name in ("leg velocity", "leg acceleration", "feed")) <= 1.01
    assert "segment 0" in str(found["feed"])


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
def test_limit_uses_of_a_long_program_are_found_part_by_part(interpolation, monkeypatch):
    m = machine(interpolation=interpolation)
    trajectory = timed(raster(lines=2, feed=0.2), m)
    tool = {"max_tip_acceleration": 2.0, "max_tip_jerk": 70.0, "max_axis_velocity": 3.0, "max_axis_acceleration": 9.0}
    whole = certify(trajectory, limited(m, **tool))
    monkeypatch.setattr("pentapod.timing.certificates.AT_ONCE", 61)
    assert certify(trajectory, limited(m, **tool)) == whole


def test_certified_feed_is_that_of_the_given_tips():
    """Tips on a circle, started at once: the spline overshoots between the first rows, to the maximum of a quartic."""
    m = machine(interpolation="cubic")
    trajectory = timed(straight([0.1, 0, 0, 0, 0], 0.05, 0.1), m)
    n = round(trajectory.duration / 1e-3) + 1
    turn = 4.0 * np.arange(n) * 1e-3
    tips = 0.01 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    found = shares(certify(trajectory, m, tips=tips))
    spline = CubicSpline(np.arange(n) * 1e-3, tips, bc_type="clamped")
    at = np.linspace(0, (n - 1) * 1e-3, 50 * n)
    top = at[np.linalg.norm(spline(at, 1), axis=1).argmax()]
    near = np.linspace(max(top - 1e-3, 0.0), min(top + 1e-3, at[-1]), 20_001)
    dense = np.linalg.norm(spline(near, 1), axis=1).max()
    assert found["feed"].value == pytest.approx(dense, rel=1e-7)


def leaning():
    return Piece(by_tip(line(), nodding()), 0.05, 0.2, inner_knots=tuple(np.linspace(0, 0.05, 52)[1:-1]))


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
@pytest.mark.parametrize("speeds", [(0.05, 0.0), (0.0, 0.05)])
def test_an_axis_is_judged_where_the_motion_begins_at_a_speed(interpolation, speeds):
    """By the path's own derivative of the axis, at dense times; what comes before and after is not the motion's."""
    m, piece = machine(interpolation=interpolation), leaning()
    trajectory = retime(Path((piece,)), m, start_speed=speeds[0], end_speed=speeds[1])
    assert isinstance(trajectory, Trajectory), str(trajectory)
    t = np.linspace(0.0, trajectory.duration, 20_001)
    s, v = trajectory.station(t), trajectory.station(t, 1)
    turning = np.linalg.norm(piece.pose(s, 1)[1], axis=1) * v
    found = shares(certify(trajectory, limited(m, max_axis_velocity=3.0)))["axis velocity"]
    assert found.value == pytest.approx(turning.max(), rel=1e-3)
    assert 0.0 <= found.time <= trajectory.duration


def test_a_spot_is_judged_where_the_motion_begins_at_a_speed():
    """20 mm beyond the tip, as far as the axis leads it: by the path's own derivatives."""
    m, piece, beyond = machine(interpolation="cubic"), leaning(), -0.02
    trajectory = retime(Path((piece,)), m, start_speed=0.05, end_speed=0.05)
    assert isinstance(trajectory, Trajectory), str(trajectory)
    rows = np.arange(round(trajectory.duration / 1e-3) + 1) * 1e-3
    tips, axes = trajectory.pose(rows)
    t = np.linspace(0.0, trajectory.duration, 20_001)
    (tip, axis), v = piece.pose(trajectory.station(t), 1), trajectory.station(t, 1)
    speeds = np.linalg.norm(tip + beyond * axis, axis=1) * v
    found = shares(certify(trajectory, m, legs=trajectory(rows), tips=tips, axes=axes, spot=beyond))["feed"]
    assert found.value == pytest.approx(speeds.max(), rel=1e-3)


def test_limit_use_names_place_and_leg():
    """Leg 4 is the one that moves most, and the second section is the fast one."""
    m = machine(a=50.0)
    sections = [(0.05, 0.05, SegmentKind.CUT, 7), (0.1, 0.2, SegmentKind.CUT, 8)]
    trajectory = timed(straight([0, 0.1, 0, 0.9, 0], 0.1, sections=sections), m)
    found = shares(certify(trajectory, m))
    assert found["leg velocity"].leg == 4
    assert found["leg velocity"].segment == 8
    assert found["leg velocity"].station > 0.05
    assert found["feed"].share <= 1.0
    assert set(found) == {"leg velocity", "leg acceleration", "leg jerk", "feed"}


def test_limit_use_beyond_the_limit_says_where():
    m = machine()
    trajectory = timed(leaning(), m)
    legs = trajectory(np.arange(round(trajectory.duration / 1e-3) + 1) * 1e-3)
    legs[40, 2] += 1e-4
    found = shares(certify(trajectory, m, legs=legs))
    assert found["leg acceleration"].share > 20.0
    assert found["leg acceleration"].leg == 3
    assert found["leg acceleration"].time == pytest.approx(0.04)


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
def test_certified_feed_of_two_pieces_that_end_at_a_speed_is_the_feed(interpolation):
    """The setpoints that continue the last piece follow on its stations along the whole path."""
    m = machine(interpolation=interpolation)
    first = straight([0.5, 0.2, 0, 0, 0], 0.05, 0.1)
    second = straight([0.5, 0.2, 0, 0, 0], 0.05, 0.1, start=first(np.array([0.05]))[0])
    trajectory = retime(Path((first, second)), m, end_speed=0.05)
    assert isinstance(trajectory, Trajectory), str(trajectory)
    assert 0.99 < shares(certify(trajectory, m))["feed"].share < 1.0
