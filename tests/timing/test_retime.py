from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from timing_paths import (
    Path,
    Piece,
    by_tip,
    circle,
    line,
    machine,
    nodding,
    raster,
    straight,
    used,
    used_by_rows,
)

from lengths import examples
from pentapod.base.errors import InputError
from pentapod.base.refusal import Refusal
from pentapod.timing import Trajectory, retime
from pentapod.timing.limits.limits import Limits
from pentapod.timing.pieces.grid import first_grid
from pentapod.toolpath.toolpath import SegmentKind

TIGHT = {"velocity_margin": 1e-4, "acceleration_margin": 1e-4}
FINE = 1e-5  # a controller period so short that whole periods do not show


def timed(path, m, **options):
    """The law without jerk limits, for which there are closed forms."""
    result = retime(path, m, **{"limit_jerk": False, **options})
    assert isinstance(result, Trajectory), str(result)
    return result


def nod(length=0.05, feed=0.2, wavelength=0.02, amplitude=0.1):
    knots = tuple(np.arange(wavelength / 20, length, wavelength / 20))
    return Piece(by_tip(line(), nodding(wavelength, amplitude)), length, feed, inner_knots=knots)


PATHS = {
    "circle": lambda: Piece(by_tip(circle()), 0.3, 0.15),
    "nod": nod,
    "small nod": lambda: nod(0.02, 0.2, 0.002, 0.01),
    "raster": lambda: raster(feed=0.3),
    "sharp raster": lambda: raster(feed=0.1, pitch=1e-4, corner=1e-5),
}
QUICK = ("circle", "nod", "sharp raster")
SOME = [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in PATHS]


# Closed forms


@pytest.mark.parametrize("length", [1e-6, 1e-4, 0.02, 0.3])
@pytest.mark.parametrize("slope", [0.05, 0.6, 1.0])
def test_one_leg_straight_takes_the_time_of_the_trapezoid(length, slope):
    v, a = 0.2, 5.0
    distance, top = slope * length, v
    ramp = v * v / a
    expected = distance / v + v / a if distance > ramp else 2 * np.sqrt(distance / a)
    m = machine(v=v, a=a, rapid=99.0, period=FINE)
    trajectory = timed(Path((straight([0, 0, -slope, 0, 0], length),)), m, **TIGHT)
    assert trajectory.duration == pytest.approx(expected, rel=6e-4, abs=1.5 * FINE)
    assert trajectory.duration > expected
    assert np.abs(trajectory(np.linspace(0, trajectory.duration, 999), 1)).max() <= top


def test_retime_is_limited_by_the_slowest_leg():
    m = machine(v=[0.5, 0.4, 0.3, 0.2, 0.1], a=[5, 4, 3, 2, 1], rapid=99.0, period=FINE)
    trajectory = timed(Path((straight([0.1, 0.1, 0.1, 0.1, 0.1], 0.5),)), m, **TIGHT)
    assert trajectory.duration == pytest.approx(0.05 / 0.1 + 0.1 / 1, rel=6e-4)
    assert "leg 5 velocity" in used_names(trajectory)


def test_circle_at_feed_takes_its_length_over_the_feed_and_the_ramps():
    radius, feed, m = 0.05, 0.01, machine(a=500.0)
    length = 2 * np.pi * radius
    trajectory = timed(Path((Piece(by_tip(circle(radius)), length, feed),)), m, **TIGHT)
    assert trajectory.duration == pytest.approx(length / feed, rel=5e-4)
    assert trajectory.duration > length / feed
    assert used_names(trajectory) >= {"feed"}


def test_rapid_rate_holds_on_rapids_only():
    sections = [
        (0.1, np.inf, SegmentKind.RAPID, 3),
        (0.12, 0.01, SegmentKind.CUT, 4),
        (0.2, 0.02, SegmentKind.LINK, 5),
    ]
    m = machine(v=9, a=50.0, rapid=0.25)
    trajectory = timed(Path((straight([1, 0, 0, 0, 0], 0.2, sections=sections),)), m)
    t = np.linspace(0, trajectory.duration, 40_001)
    s, speed, segment = trajectory.station(t), trajectory.station(t, 1), trajectory.segment(t)
    for end, feed, number in ((0.1, 0.25, 3), (0.12, 0.01, 4), (0.2, 0.02, 5)):
        assert 0.99 * feed < speed[segment == number].max() < feed
        assert s[segment == number].max() == pytest.approx(end, abs=1e-4)
    assert used_names(trajectory) >= {"feed", "rapid rate", "leg 1 acceleration"}
    # No interval between setpoints that touches a slow section is faster than it, on average.
    rows = trajectory.station(np.arange(round(trajectory.duration / 1e-3) + 1) * 1e-3)
    means = np.diff(rows) / 1e-3
    touches = (rows[1:] > 0.1) & (rows[:-1] < 0.12)
    assert means[touches].max() < 0.01


def used_names(trajectory):
    return {trajectory.profile.constraint_names[k] for k in np.unique(trajectory.profile.active)}


# Limits


@pytest.mark.parametrize("name", SOME)
def test_limits_hold_between_gridpoints_and_are_used(name):
    m, piece = machine(), PATHS[name]()
    trajectory = timed(Path((piece,)), m)
    v, a = used(trajectory, m)
    feed = trajectory.station(np.linspace(0, trajectory.duration, 100_000), 1).max() / piece.section_feeds[0]
    assert max(v, a, feed) < 1.0
    assert max(v, a, feed) > 0.985
    v, a, mean = used_by_rows(trajectory, m)
    assert max(v, a, mean / piece.section_feeds[0]) < 1.0


@settings(max_examples=examples(6, 12), deadline=None)
@given(
    length=st.floats(-7, 0),
    shape=st.floats(-1.3, 1.5),
    lively=st.floats(-1, 1.5),
    v=st.floats(-2, 0.3),
    a=st.floats(-1, 1.5),
    feed=st.floats(-4, 0),
)
def test_limits_hold_at_every_scale(length, shape, lively, v, a, feed):
    length, shape, lively, v, a, feed = (10.0**x for x in (length, shape, lively, v, a, feed))
    wavelength = length * shape
    m = machine(v=v, a=a)
    trajectory = timed(Path((nod(length, feed, wavelength, min(0.3, wavelength * lively)),)), m)
    assert max(used(trajectory, m, 20_001)) < 1.0
    assert trajectory.station([trajectory.duration])[0] == length


@pytest.mark.parametrize("name", SOME)
def test_cubic_interpolant_keeps_the_limits(name):
    interpolate = pytest.importorskip("scipy.interpolate")
    m, piece = machine(interpolation="cubic"), PATHS[name]()
    trajectory = timed(Path((piece,)), m)
    t = np.arange(round(trajectory.duration / 1e-3) + 1) * 1e-3
    spline = interpolate.CubicSpline(t, trajectory(t), bc_type="clamped")
    dense = np.linspace(0, t[-1], 20 * len(t))
    assert np.abs(spline(dense, 1)).max() < m.legs.max_velocity[0]
    assert np.abs(spline(dense, 2)).max() < m.legs.max_acceleration[0]
    station = interpolate.CubicSpline(t, trajectory.station(t), bc_type="clamped")
    assert station(dense, 1).max() < piece.section_feeds[0]
    # And the price is small against the controller that goes straight.
    linear = timed(Path((PATHS[name](),)), machine())
    assert linear.duration <= trajectory.duration < 1.04 * linear.duration + 0.01


def test_cubic_interpolant_across_stops():
    d = np.array([1, -0.4, 0, 0.2, 0])
    first, second = straight(d, 0.01), straight(-d[::-1], 0.02, start=0.8 + 0.01 * d)
    m = machine(interpolation="cubic")
    trajectory = timed(Path((first, second, nod_after(second))), m)
    from scipy.interpolate import CubicSpline

    t = np.arange(round(trajectory.duration / 1e-3) + 1) * 1e-3
    spline = CubicSpline(t, trajectory(t), bc_type="clamped")
    assert np.abs(spline(t, 2)).max() < 5.0


def nod_after(piece):
    end, wave = piece(np.array([piece.length]))[0], 200.0

    def legs(s):
        w = wave * s[:, None]
        k = 0.01 * np.array([1, 2, 3, -2, -1])
        return end + k * np.sin(w), k * wave * np.cos(w), -k * wave**2 * np.sin(w)

    return Piece(legs, 0.1, 0.3, inner_knots=tuple(np.linspace(0, 0.1, 60)[1:-1]))


# Against another method, and laws


def two_passes(piece, m, n=20_000):
    """Duration by forward and backward integration of the largest and least ṡ̈ on a fine grid, in plain Python."""
    s = np.linspace(0, piece.length, n + 1)
    h = s[1]
    q1, q2 = piece(s, 1), piece(s, 2)
    v, a = m.legs.max_velocity, m.legs.max_acceleration
    cap = np.minimum(np.square(v / np.maximum(np.abs(q1), 1e-12)).min(1), piece.section_feeds[0] ** 2)

    def pushes(k, x):
        low = ((-a - q2[k] * x) / q1[k], (a - q2[k] * x) / q1[k])
        return np.minimum(*low).max(), np.maximum(*low).min()

    for k in range(n + 1):  # lower the cap until some acceleration is allowed, by bisection
        low, high = pushes(k, cap[k])
        if low > high:
            below, above = 0.0, cap[k]
            for _ in range(50):
                mid = (below + above) / 2
                low, high = pushes(k, mid)
                below, above = (mid, above) if low <= high else (below, mid)
            cap[k] = below
    x = cap.copy()
    x[0] = x[-1] = 0.0
    for k in range(n, 0, -1):
        x[k - 1] = min(x[k - 1], x[k] - 2 * h * pushes(k, x[k])[0])
    for k in range(n):
        x[k + 1] = min(x[k + 1], x[k] + 2 * h * pushes(k, x[k])[1])
    root = np.sqrt(np.maximum(x, 0.0))
    return float((2 * h / (root[1:] + root[:-1])).sum())


@pytest.mark.parametrize("name", ["circle", "nod", "raster"])
def test_duration_agrees_with_plain_integration(name):
    m = machine(period=FINE)
    trajectory = timed(Path((PATHS[name](),)), m, **TIGHT)
    assert trajectory.duration == pytest.approx(two_passes(PATHS[name](), m, 8000), rel=4e-3)


@pytest.mark.parametrize("name", SOME)
def test_retime_of_a_reversed_path_takes_as_long(name):
    piece = PATHS[name]()
    m = machine(period=FINE)

    def legs(s):
        q, q1, q2 = (piece(piece.length - s, k) for k in range(3))
        return q, -q1, q2

    back = Piece(legs, piece.length, piece.section_feeds[0], inner_knots=tuple(piece.length - piece.knots[-2:0:-1]))
    there, again = timed(Path((piece,)), m), timed(Path((back,)), m)
    assert again.duration == pytest.approx(there.duration, rel=2e-3)


@settings(max_examples=examples(3, 6), deadline=None)
@given(k=st.floats(0.05, 20.0))
def test_retime_does_not_depend_on_units(k):
    """Lengths times k take as long when every limit is times k."""
    piece = nod()

    def legs(s):
        q, q1, q2 = (piece(s / k, n) for n in range(3))
        return k * q, q1, q2 / k

    big = Piece(legs, k * piece.length, k * piece.section_feeds[0], inner_knots=tuple(k * piece.knots[1:-1]))
    small = timed(Path((piece,)), machine(period=FINE))
    scaled = timed(Path((big,)), machine(v=0.5 * k, a=5 * k, rapid=0.3 * k, period=FINE))
    assert scaled.duration == pytest.approx(small.duration, rel=1e-3, abs=2 * FINE)


@settings(max_examples=examples(3, 12), deadline=None)
@given(k=st.floats(0.3, 3.0))
def test_retime_scales_with_time(k):
    """Velocities times k and accelerations times k² take 1/k of the time."""
    slow = timed(Path((nod(),)), machine(period=FINE))
    fast = timed(Path((nod(feed=0.2 * k),)), machine(v=0.5 * k, a=5 * k * k, rapid=0.3 * k, period=FINE / k))
    assert fast.duration * k == pytest.approx(slow.duration, rel=1e-3)


def test_retime_with_higher_limits_is_never_slower():
    durations = [timed(Path((nod(),)), machine(a=a, period=FINE)).duration for a in (2.0, 4.0, 8.0, 16.0)]
    assert durations == sorted(durations, reverse=True)


# Stops and ends


def test_stops_are_exact_and_fall_on_setpoints():
    d = np.array([1, 0.2, 0, -0.3, 0.1])
    pieces = [straight(d, 0.01)]
    for length, turn in ((1e-6, 1), (0.0, 1), (0.02, -1), (1e-3, 1)):
        before = pieces[-1]
        start = before(np.array([before.length]))[0]
        pieces.append(straight(turn * d, length, start=start))
    m = machine()
    path = Path(tuple(pieces))
    trajectory = timed(path, m)
    assert trajectory.indices == (0, 1, 3, 4)
    periods = trajectory.starts / 1e-3
    assert np.abs(periods - np.rint(periods)).max() < 1e-9
    assert np.abs(trajectory(trajectory.starts, 1)).max() == 0.0
    assert np.allclose(trajectory(trajectory.starts[-1:]), pieces[-1](np.array([1e-3])), atol=0, rtol=0)
    assert np.allclose(trajectory.station(trajectory.starts), path.starts[[0, 1, 2, 4, 5]], atol=1e-15)
    assert np.abs(trajectory([-1.0, 99.0], 1)).max() == 0.0
    t = np.random.default_rng(0).permutation(np.linspace(0, trajectory.duration, 777))
    assert np.array_equal(trajectory(t), trajectory(np.sort(t))[np.argsort(np.argsort(t))])


def test_profile_is_ordered_and_named():
    trajectory = timed(Path((raster(feed=0.3),)), machine())
    p = trajectory.profile
    legs = tuple(f"leg {k} {what}" for what in ("velocity", "acceleration", "jerk") for k in range(1, 6))
    assert p.constraint_names == (*legs, "feed", "rapid rate")
    assert len(p.times) == len(p.stations) == len(p.speeds) == len(p.active) == len(p.shares)
    assert (np.diff(p.times) > 0).all()
    assert (np.diff(p.stations) > 0).all()
    assert np.allclose(trajectory.station(p.times), p.stations, atol=1e-9)
    assert np.median(p.shares) > 0.99
    assert p.shares.max() < 1.001


def test_retime_same_input_same_bits():
    one, two = (timed(Path((raster(),)), machine()) for _ in range(2))
    t = np.linspace(0, one.duration, 1000)
    assert one.duration == two.duration
    assert np.array_equal(one(t), two(t))


def test_retime_progress_ends_at_one():
    seen = []
    timed(Path((nod(), nod_after(nod()))), machine(), progress=lambda stage, f, note="": seen.append((stage, f)))
    assert [s for s, _ in seen] == ["timing"] * 2
    assert seen[-1][1] == pytest.approx(1.0)


# What cannot be done, and bad input


def broken(at, order):
    piece = straight([1, 0, 0, 0, 0], 0.1, inner_knots=(0.03, 0.06))

    def legs(s):
        values = [np.array(x) for x in piece.legs(s)]
        values[order][np.abs(s - at) < 1e-6, 2] = np.nan
        return values

    return replace(piece, legs=legs)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_path_that_is_not_finite_is_refused_with_the_place(order):
    result = retime(Path((broken(0.06, order),)), machine())
    assert isinstance(result, Refusal)
    assert result.stage == "timing"
    assert "not finite" in result.cause
    assert "60 mm along the path" in result.cause
    assert "segment 0" in result.cause
    assert result.diagnosis[0].waypoints == ((2, 2),)


def test_a_jump_at_a_stop_is_refused():
    path = Path((straight([1, 0, 0, 0, 0], 0.1), straight([1, 0, 0, 0, 0], 0.1, start=0.95)))
    result = retime(path, machine())
    assert isinstance(result, Refusal)
    assert "jump by 150 mm" in result.cause
    assert "legs move by (1, 0, 0, 0, 0) m for each metre" in result.cause
    (blame,) = result.diagnosis
    assert str(blame) == "leg 2 jumps by 150 mm at waypoints 0"


def test_turning_about_a_still_tip_and_no_motion_at_all_are_refused():
    still = straight([0, 0, 0, 0, 0], 0.0)
    assert "nothing moves" in str(retime(Path((still,)), machine()))

    def legs(s):
        return 0.8 + np.linspace(0, 0.1, len(s))[:, None] * np.ones(5), np.zeros((len(s), 5)), np.zeros((len(s), 5))

    turning = Piece(legs, 0.0)
    turning.knots = np.array([0.0])
    turning.length = 1e-14
    assert "stands still" in str(retime(Path((turning,)), machine()))


def test_a_failing_solver_is_a_refusal_that_names_the_gridpoint(monkeypatch):
    from pentapod.timing.pieces import piece as module
    from pentapod.timing.topp.stages import Failure

    monkeypatch.setattr(module, "fastest", lambda *_, **__: Failure(7, "not controllable", (1, 3)))
    result = retime(Path((nod(),)), machine())
    assert isinstance(result, Refusal)
    assert "piece 0, gridpoint 7" in result.cause
    assert "not controllable" in result.cause
    assert "in conflict: leg 2 acceleration and leg 4 acceleration" in result.cause
    assert "m for each metre there" in result.cause
    assert [blame.constraint for blame in result.diagnosis] == ["leg 2 acceleration", "leg 4 acceleration"]
    (pair,) = result.diagnosis[0].waypoints
    assert 0 <= pair[0] <= pair[1] <= pair[0] + 1
    assert str(result.diagnosis[0]).startswith("leg 2 acceleration at waypoints ")


@pytest.mark.parametrize("margin", [0.0, -0.1, 0.5, np.nan])
def test_retime_margins_are_fractions(margin):
    with pytest.raises(InputError, match="margin"):
        retime(Path((nod(),)), machine(), velocity_margin=margin)


def test_corners_have_four_stages_from_knot_to_knot():
    piece = raster(lines=4, feed=0.3)
    limits = Limits.of(machine(), 0.002, 0.005, 1.5e-3)
    s = first_grid(piece, limits)
    counts = np.diff(np.searchsorted(s, piece.knots))
    middle = (piece.knots[:-1] + piece.knots[1:]) / 2
    turns = np.abs(piece(middle, 2)).max(axis=1) > 10.0
    assert turns.sum() == 9  # three half circles, each with its ramps
    assert counts[turns].min() >= 4


def test_retime_margin_leaves_room():
    m = machine()
    trajectory = timed(Path((nod(),)), m, velocity_margin=0.1, acceleration_margin=0.2)
    v, a = used(trajectory, m)
    assert v < 0.951
    assert 0.78 < a < 0.95


def test_retime_asks_a_machine_for_five_attributes_only():
    """Timing asks a machine for the limits of legs, drives and tool, its rapid rate and controller, and no more."""
    m = machine()
    assert isinstance(m, SimpleNamespace)
    assert set(vars(m)) == {"legs", "rapid_velocity", "controller", "tool_limits", "drive_forces"}
