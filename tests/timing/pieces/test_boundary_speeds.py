"""Given speeds at the start and the end of a motion: kept exactly within the limits, or refused with the reason."""

import numpy as np
import pytest
from timing_paths import Path, Piece, by_tip, circle, machine, raster, straight

from pentapod.base.errors import InputError
from pentapod.base.refusal import Refusal
from pentapod.timing import Trajectory, certify, retime

PERIOD = 1e-3


def arc():
    return Path((Piece(by_tip(circle()), 0.1, 0.1, inner_knots=tuple(np.linspace(0, 0.1, 22)[1:-1])),))


@pytest.mark.parametrize(("interpolation", "limit_jerk"), [("linear", True), ("linear", False), ("cubic", True)])
@pytest.mark.parametrize(("v", "w"), [(0.05, 0.0), (0.0, 0.08), (0.09, 0.05)])
def test_given_speeds_are_kept_within_the_limits(interpolation, limit_jerk, v, w):
    m = machine(interpolation=interpolation)
    motion = retime(arc(), m, limit_jerk=limit_jerk, start_speed=v, end_speed=w)
    assert isinstance(motion, Trajectory), str(motion)
    ends = np.array([0.0, motion.duration])
    np.testing.assert_allclose(motion.station(ends, 1), [v, w], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(motion.station(ends), [0.0, 0.1], atol=1e-15)
    assert motion.duration / PERIOD == pytest.approx(round(motion.duration / PERIOD), abs=1e-6)
    shares = {use.quantity: use.share for use in certify(motion, m)}
    assert max(shares["leg velocity"], shares["leg acceleration"], shares["feed"]) <= 1.01
    if limit_jerk:
        assert shares["leg jerk"] <= 1.05
        np.testing.assert_allclose(motion.station(ends[:1], 2), 0.0, atol=1e-3)
    rest = retime(arc(), m, limit_jerk=limit_jerk)
    assert isinstance(rest, Trajectory)
    assert motion.duration < rest.duration


@pytest.mark.parametrize(("interpolation", "v", "w"), [("linear", 0.05, 0.05), ("cubic", 0.0, 0.05)])
def test_given_speeds_stay_where_limits_are_lowered(interpolation, v, w):
    """A raster at whose corners limits are lowered after they were measured; its ends are no stops."""
    path, m = Path((raster(lines=3, feed=0.2),)), machine(interpolation=interpolation)
    motion, rest = retime(path, m, start_speed=v, end_speed=w), retime(path, m)
    assert isinstance(motion, Trajectory), str(motion)
    assert isinstance(rest, Trajectory)
    np.testing.assert_allclose(motion.station([0.0, motion.duration], 1), [v, w], rtol=1e-9, atol=1e-12)
    assert motion.duration < rest.duration
    assert max(use.share for use in certify(motion, m) if use.quantity != "leg jerk") <= 1.0 + 1e-9


@pytest.mark.parametrize("length", [2e-5, 1.02e-4])
def test_path_that_fills_no_whole_periods_at_its_speeds_is_refused(length):
    """A fifth of a period, and a little more than one: the next whole one would need another speed at the ends."""
    short = Path((straight([0.0, 1.0, 0.0, 0.0, 0.0], length, 0.2),))
    refused = retime(short, machine(), limit_jerk=False, start_speed=0.1, end_speed=0.1)
    assert isinstance(refused, Refusal)
    assert "whole number of periods" in str(refused)


@pytest.mark.parametrize(("v", "w", "why"), [(0.2, 0.0, "higher than any"), (0.0, 0.2, "above a limit")])
def test_given_speeds_above_the_limits_are_refused(v, w, why):
    refused = retime(arc(), machine(), start_speed=v, end_speed=w)
    assert isinstance(refused, Refusal)
    assert why in str(refused)


def test_start_speed_from_which_the_motion_cannot_stop_is_refused():
    short = Path((straight([0.0, 1.0, 0.0, 0.0, 0.0], 1e-4, 0.2),))
    refused = retime(short, machine(), start_speed=0.15)
    assert isinstance(refused, Refusal)
    assert "the end can be reached" in str(refused)


@pytest.mark.parametrize("speeds", [{"start_speed": -0.1}, {"end_speed": np.inf}, {"start_speed": np.nan}])
def test_negative_and_infinite_speeds_raise_input_errors(speeds):
    with pytest.raises(InputError):
        retime(arc(), machine(), **speeds)


def test_given_speeds_with_cubics_need_limited_jerks():
    with pytest.raises(InputError, match="limit_jerk"):
        retime(arc(), machine(interpolation="cubic"), limit_jerk=False, start_speed=0.05)


@pytest.mark.parametrize(("before", "after"), [(0, 0), (1, 0), (0, 1), (2, 2)])
def test_given_speeds_next_to_a_dwell_raise_input_errors(before, after):
    """Also where the dwell stands beyond pieces of no length, which are passed over."""
    spot = straight([0.0] * 5, 0.0, start=arc().pieces[0](np.array([0.0]), 0)[0])
    there = straight([0.0] * 5, 0.0, start=arc().pieces[0](np.array([0.1]), 0)[0])
    pieces = (spot,) * before + arc().pieces + (there,) * after
    standing = np.zeros(len(pieces) + 1)
    for at in range(before + 1):
        path = Path(pieces, tuple(standing + 0.1 * (np.arange(len(standing)) == at)))
        with pytest.raises(InputError, match=r"start_speed: the path stands there for 0\.1 s"):
            retime(path, machine(), start_speed=0.05)
        assert isinstance(retime(path, machine(), end_speed=0.05), Trajectory)
    for at in range(before + 1, len(standing)):
        path = Path(pieces, tuple(standing + 0.1 * (np.arange(len(standing)) == at)))
        with pytest.raises(InputError, match="end_speed: the path stands there"):
            retime(path, machine(), end_speed=0.05)
        motion = retime(path, machine(), start_speed=0.05)
        assert motion.station(0.0, 1) == pytest.approx(0.05, rel=1e-9)
