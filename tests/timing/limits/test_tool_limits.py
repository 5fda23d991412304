"""Limits of tip and axis: closed forms and integrals, what the setpoints do, who is named, all engines alike."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.interpolate import CubicSpline
from test_retime import nod
from timing_paths import Path, Piece, by_tip, circle, line, machine, nodding, raster

from pentapod.base.errors import MachineError
from pentapod.machine.parts import ToolLimits
from pentapod.timing import Trajectory, certify, explain, override, retime
from pentapod.timing.limits.polytopes import across_path, polygon, polyhedron

FREE = {"v": 50.0, "a": 5e3, "rapid": 10.0}
FINE = 1e-4


def timed(path, m, **options):
    result = retime(path, m, **options)
    assert isinstance(result, Trajectory), str(result)
    return result


def setpoints(trajectory, m):
    """Tips and axes as scipy's spline joins them; their rates and accelerations on a dense grid, jerks in between."""
    period = m.controller.period
    t = np.arange(round(trajectory.duration / period) + 1) * period
    tips, axes = trajectory.pose(t)
    spline = CubicSpline(t, np.hstack([tips, axes]), bc_type="clamped")
    dense = np.linspace(0.0, t[-1], 8 * len(t))
    middle = t[:-1] + 0.5 * period
    return axes, spline(dense, 1), spline(dense, 2), spline(middle, 3)


def test_tip_acceleration_on_a_circle_takes_the_time_of_the_friction_circle():
    """From rest dv/dt = √(A² − v⁴/r²) up to v = √(A r), and the same back."""
    radius, limit = 0.05, 3.0
    length = 2 * np.pi * radius
    m = machine(**FREE, period=FINE, max_tip_acceleration=limit)
    trajectory = timed(Path((Piece(by_tip(circle(radius)), length, 5.0),)), m, limit_jerk=False)
    # In x = v²: dx/ds = 2 √(A² − x²/r²), so x = A r sin(2 s / r) until A r, after a quarter of π r.
    ramp = quad(lambda s: 1.0 / np.sqrt(limit * radius * np.sin(2.0 * s / radius)), 0.0, np.pi * radius / 4.0)[0]
    expected = 2.0 * ramp + (length - np.pi * radius / 2.0) / np.sqrt(limit * radius)
    assert expected < trajectory.duration < 1.02 * expected
    _, _, pushes, _ = setpoints(trajectory, m)
    assert 0.975 * limit < np.linalg.norm(pushes[1000:-1000, :3], axis=1).max() < limit
    assert {cause.name for cause in explain(trajectory, m).causes} == {"tip acceleration"}


def test_tip_jerk_on_a_straight_line_takes_the_time_of_four_phases():
    length, jerk = 0.2, 40.0
    m = machine(**FREE, period=1e-3, max_tip_jerk=jerk)  # a shorter one would leave much of it to rounding
    m.legs.max_jerk.flags.writeable = True
    m.legs.max_jerk[:] = 1e6
    trajectory = timed(Path((Piece(by_tip(line()), length, 5.0),)), m)
    assert trajectory.duration == pytest.approx(4.0 * (length / 2.0 / jerk) ** (1.0 / 3.0), rel=0.02)
    assert "tip jerk" in {cause.name for cause in explain(trajectory, m).causes}


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
def test_axis_velocity_and_acceleration_hold_on_setpoints(interpolation):
    m = machine(**FREE, interpolation=interpolation, max_axis_velocity=0.8, max_axis_acceleration=12.0)
    trajectory = timed(Path((Piece(by_tip(line(), nodding(0.03, 0.2)), 0.1, 5.0),)), m)
    axes, rates, _, _ = setpoints(trajectory, m)
    # By rotations: the angle from each axis to the next, and how the turns change.
    turns = np.cross(axes[:-1], axes[1:]) / 1e-3
    assert 0.9 * 0.8 < np.linalg.norm(turns, axis=1).max() < 0.8 * 1.001
    assert np.linalg.norm(np.diff(turns, axis=0), axis=1).max() / 1e-3 < 12.0 * 1.002
    assert np.linalg.norm(rates[:, 3:], axis=1).max() < 0.8 * 1.001
    use = {u.quantity: u for u in certify(trajectory, m)}
    assert use["axis velocity"].value == pytest.approx(np.linalg.norm(rates[:, 3:], axis=1).max(), rel=2e-3)
    assert max(use["axis velocity"].share, use["axis acceleration"].share) <= 1.001
    names = {cause.name for cause in explain(trajectory, m).causes}
    assert names & {"axis velocity", "axis acceleration"}


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
@pytest.mark.parametrize("piece", [lambda: raster(lines=3, feed=0.3), lambda: nod(feed=0.3)], ids=["raster", "nod"])
def test_tool_limits_together_hold_on_setpoints(piece, interpolation):
    tool = {"max_tip_acceleration": 1.5, "max_tip_jerk": 60.0, "max_axis_velocity": 0.8, "max_axis_acceleration": 10.0}
    m = machine(interpolation=interpolation, **tool)
    trajectory = timed(Path((piece(),)), m)
    use = {u.quantity: u.share for u in certify(trajectory, m)}
    assert max(use.pop("leg jerk"), use.pop("tip jerk")) < 1.05
    assert max(use.values()) < 1.0
    _, _, pushes, jerks = setpoints(trajectory, m)
    if interpolation == "cubic":
        assert np.linalg.norm(pushes[:, :3], axis=1).max() < 1.5
        assert np.linalg.norm(jerks[:, :3], axis=1).max() < 1.05 * 60.0
    free = timed(Path((piece(),)), machine(interpolation=interpolation))
    assert trajectory.duration > free.duration


def test_tool_limits_by_both_engines_agree():
    m = machine(**FREE, max_tip_acceleration=2.0, max_axis_acceleration=20.0, max_axis_velocity=1.5)
    path = Path((Piece(by_tip(circle(0.03), nodding(0.03, 0.15)), 0.08, 0.5),))
    ours, theirs = (timed(path, m, limit_jerk=False, engine=e).duration for e in ("core", "toppra"))
    assert ours == pytest.approx(theirs, rel=1e-5, abs=1.01e-3)


def test_tool_limits_far_away_change_no_bit():
    far = {"max_tip_acceleration": 1e9, "max_tip_jerk": 1e12, "max_axis_velocity": 1e9, "max_axis_acceleration": 1e9}
    path = Path((raster(lines=3, feed=0.3),))
    assert timed(path, machine(**far)).duration == timed(path, machine()).duration


@pytest.mark.slow
def test_override_keeps_tool_limits():
    m = machine(interpolation="cubic", max_tip_acceleration=1.0, max_axis_acceleration=30.0)
    path = Path((Piece(by_tip(circle(0.05), nodding(0.05, 0.1)), 0.25, 0.1),))
    trajectory = timed(path, m)
    for share in (0.0, 0.4, 1.4):
        turned = override(trajectory, m, 0.9, share)
        assert isinstance(turned, Trajectory), str(turned)
        use = {u.quantity: u.share for u in certify(turned, m)}
        assert max(use["tip acceleration"], use["axis acceleration"]) <= 1.0 + 1e-6


vectors = st.tuples(*(st.floats(-3.0, 3.0) for _ in range(3)))


@settings(max_examples=100, deadline=None)
@given(vectors, vectors, st.floats(-5.0, 5.0), st.floats(0.0, 5.0), st.floats(1e-6, 1e6))
def test_polygon_lies_in_the_circle_and_almost_fills_it(f, g, u, x, limit):
    f, g = np.array([f]) * limit, np.array([g]) * limit
    first, second = polygon(f, g, limit)
    most = np.abs(first * u + second * x).max()
    length = np.linalg.norm(f * u + g * x) / limit
    assert length <= most * (1.0 + 1e-9) + 1e-12
    assert most <= length / np.cos(np.pi / 16.0) * (1.0 + 1e-9) + 1e-12
    closest = min(np.linalg.norm(f * v + g) for v in [0.0, -(f @ g.T).item() / max((f @ f.T).item(), 1e-300)])
    assert across_path(f, g)[0] == pytest.approx(closest, rel=1e-6, abs=1e-7 * limit)


@settings(max_examples=100, deadline=None)
@given(vectors, vectors, vectors, vectors)
def test_polyhedron_touches_the_sphere_from_outside(f, g, h, state):
    f, g, h = (np.array([v]) for v in (f, g, h))
    rows = polyhedron(f, g, h, 2.0)
    x, slope, bend = state
    length = np.linalg.norm(h * x + 1.5 * g * slope + 0.5 * f * bend) / 2.0
    most = np.abs(rows[0] @ np.array([x, slope, bend])).max()
    assert length / 1.13 * (1.0 - 1e-9) <= most <= length * (1.0 + 1e-9) + 1e-12


def test_tool_limits_are_positive_and_the_stricter_counts():
    with pytest.raises(MachineError, match="positive"):
        ToolLimits(max_tip_jerk=0.0)
    both = ToolLimits(max_tip_acceleration=2.0).and_(ToolLimits(max_tip_acceleration=3.0, max_axis_velocity=1.0))
    assert both.given() == {"max_tip_acceleration": 2.0, "max_axis_velocity": 1.0}
