"""Feed override: the past stays, speed and acceleration have no step, limits hold, and the new feed is reached."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from timing_paths import Path, Piece, by_tip, line, machine, nodding, raster, straight

from lengths import examples
from pentapod.base.errors import InputError
from pentapod.timing import Trajectory, certify, override, retime

PERIOD = 1e-3


def timed(path, m):
    trajectory = retime(path, m, limit_jerk=False)
    assert isinstance(trajectory, Trajectory), str(trajectory)
    return trajectory


def nod():
    return Piece(by_tip(line(), nodding()), 0.05, 0.1, inner_knots=tuple(np.linspace(0, 0.05, 52)[1:-1]))


def two_pieces():
    first = raster(lines=3, feed=0.1)
    return Path((first, straight([0.4, 0.1, -0.3, 0.2, 0.1], 0.03, 0.1, start=first(np.array([first.length]))[0])))


def overridden(trajectory, m, time, share):
    result = override(trajectory, m, time, share, limit_jerk=False)
    assert isinstance(result, Trajectory), str(result)
    return result


def check(before, after, m, time):
    """What holds for every override."""
    t = np.arange(int(np.ceil(time / PERIOD - 1e-6)) + 1) * PERIOD
    np.testing.assert_allclose(after(t), before(t), atol=1e-13)  # the past
    assert after.duration / PERIOD == pytest.approx(round(after.duration / PERIOD), abs=1e-6)
    assert np.abs(after(np.array([after.duration]), 1)).max() == 0.0
    fine = np.linspace(0.0, after.duration, 40_001)
    assert (np.diff(after.station(fine)) >= -1e-15).all()
    uses = {use.quantity: use.share for use in certify(after, m)}
    assert max(uses["leg velocity"], uses["leg acceleration"]) <= 1.0 + 1e-6
    p = after.profile
    assert (np.diff(p.times) >= -1e-9).all()
    assert p.times[-1] == pytest.approx(after.duration, abs=1e-9)
    assert np.allclose(after.station(p.times), p.stations, atol=2e-5)  # as near as the plans themselves say it
    assert len(p.times) == len(p.active) == len(p.shares) == len(p.speeds) == len(p.stations)


def steps(trajectory, start, stop):
    """Largest steps of speed and of acceleration between moments 1 µs apart, beyond what the rates explain."""
    t = np.arange(start, stop, 1e-6)
    speed, push = trajectory.station(t, 1), trajectory.station(t, 2)
    return np.abs(np.diff(speed)).max(), np.abs(np.diff(push)).max()


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
@pytest.mark.parametrize("share", [0.1, 0.6, 1.0, 1.5])
def test_override_reaches_the_scaled_feed(interpolation, share):
    m = machine(interpolation=interpolation)
    trajectory = timed(two_pieces(), m)
    after = overridden(trajectory, m, 0.31, share)
    check(trajectory, after, m, 0.31)
    assert after.station([after.duration])[0] == pytest.approx(trajectory.path.starts[-1], abs=1e-12)
    late = np.linspace(0.31 + 0.5 * (after.duration - 0.31), after.duration, 20_001)
    assert after.station(late, 1).max() <= 0.1 * share * (1 + 1e-3)
    assert after.station(late, 1).max() >= 0.9 * 0.1 * share
    if share > 1.0:
        assert after.duration < trajectory.duration
    if share < 1.0:
        assert after.duration > trajectory.duration


def test_override_has_no_step_of_speed_or_acceleration():
    """On a straight line at feed the old plan's acceleration is 0: the transition starts and ends without a step."""
    m = machine(interpolation="cubic")
    trajectory = timed(Path((straight([0.5, 0.2, 0, -0.3, 0.1], 0.2, 0.1),)), m)
    for share in (0.3, 1.4):
        after = overridden(trajectory, m, 0.8, share)
        speed, push = steps(after, 0.75, 1.2)
        assert speed <= 1e-6 * 20.0  # m/s² times a microsecond
        assert push <= 0.02 * np.abs(after.station(np.arange(0.75, 1.2, 1e-5), 2)).max() + 1e-9


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
def test_override_holds_and_resumes(interpolation):
    m = machine(interpolation=interpolation)
    trajectory = timed(two_pieces(), m)
    held = overridden(trajectory, m, 0.4, 0.0)
    check(trajectory, held, m, 0.4)
    assert 0.4 < held.duration < 0.8
    assert held.station([held.duration])[0] < trajectory.path.starts[1]
    resumed = overridden(held, m, held.duration + 0.25, 1.0)
    check(held, resumed, m, held.duration + 0.25)
    still = np.linspace(held.duration, held.duration + 0.25, 50)
    assert np.ptp(resumed(still), axis=0).max() == 0.0
    assert resumed.station([resumed.duration])[0] == pytest.approx(trajectory.path.starts[-1], abs=1e-12)
    assert resumed.duration < trajectory.duration + 0.25 + 2 * (held.duration - 0.4) + 0.3


def test_feed_hold_on_a_line_is_about_as_quick_as_the_legs_allow():
    """0.1 m/s, 5 m/s² on a leg that moves half as fast: 10 ms at full braking, smoothly 1.875 times that."""
    m = machine()
    trajectory = timed(Path((straight([0.5, 0, 0, 0, 0], 0.2, 0.1),)), m)
    held = overridden(trajectory, m, 1.0, 0.0)
    assert held.duration - 1.0 <= 24e-3 + 1e-9


KNOB = st.just(0.0) | st.floats(0.1, 1.5)


@settings(max_examples=examples(2, 6), deadline=None)
@given(st.floats(0.0, 1.2), KNOB, KNOB, st.sampled_from(["linear", "cubic"]))
@example(0.0, 0.0, 0.5, "linear")
@example(0.0, 0.0, 0.5, "cubic")
def test_two_overrides_at_any_time_keep_the_limits(when, one, two, interpolation):
    m = machine(interpolation=interpolation)
    trajectory = timed(Path((nod(),)), m)
    first = when * trajectory.duration / 1.3
    after = overridden(trajectory, m, first, one)
    check(trajectory, after, m, first)
    second = first + 0.03
    if after.station([after.duration])[0] < trajectory.path.starts[-1] - 1e-9 or second < after.duration - PERIOD:
        again = overridden(after, m, second, two)
        check(after, again, m, min(second, after.duration))


def test_override_at_a_stop_is_the_new_plan_from_rest():
    m = machine()
    trajectory = timed(two_pieces(), m)
    after = overridden(trajectory, m, float(trajectory.starts[1]), 0.5)
    check(trajectory, after, m, float(trajectory.starts[1]))
    whole = overridden(trajectory, m, 0.0, 0.5)
    check(trajectory, whole, m, 0.0)
    assert whole.duration > 1.6 * trajectory.duration
    assert overridden(trajectory, m, float(trajectory.starts[1]), 0.0).duration == pytest.approx(trajectory.starts[1])


def test_override_just_before_the_end_changes_nothing():
    m = machine()
    trajectory = timed(Path((nod(),)), m)
    after = overridden(trajectory, m, trajectory.duration - 5e-3, 0.5)
    assert after.duration == trajectory.duration


@pytest.mark.parametrize(
    ("time", "share"), [(0.1, -0.1), (0.1, 1e-6), (0.1, 1.6), (-1.0, 1.0), (np.nan, 1.0), (0.1, np.nan)]
)
def test_override_out_of_range_is_an_error(time, share):
    m = machine()
    trajectory = timed(Path((nod(),)), m)
    with pytest.raises(InputError):
        override(trajectory, m, time, share)


def test_override_after_the_end_is_an_error():
    m = machine()
    trajectory = timed(Path((nod(),)), m)
    with pytest.raises(InputError, match="over"):
        override(trajectory, m, trajectory.duration + 1.0, 1.0)
