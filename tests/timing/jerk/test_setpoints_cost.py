"""Loss of time by keeping the limits at setpoints, and paths that bend hard right beside a rest."""

from dataclasses import replace

import numpy as np
import pytest
from limit_matrix import MATRIX, Known
from timing_paths import Path, machine

from pentapod.timing import Trajectory, certify, retime
from pentapod.timing.path.path import third_derivatives


def timed(piece, acceleration, jerk):
    """The trajectory of one piece, whose setpoints keep every limit."""
    m = machine(a=acceleration, rapid=1e3, interpolation="cubic")
    m.legs = replace(m.legs, max_jerk=np.full(5, jerk))
    trajectory = retime(Path((piece,)), m)
    assert isinstance(trajectory, Trajectory), str(trajectory)
    assert max(use.share for use in certify(trajectory, m)) < 1.0
    return trajectory


@pytest.mark.parametrize(("acceleration", "jerk"), [(20.0, 200.0), (20.0, 400.0)])
def test_setpoints_of_tight_turns_keep_the_limits_for_less_than_two_percent(acceleration, jerk):
    """Limits are lowered about single places; running slower there would cost about 3 %, and would be reported."""
    assert timed(MATRIX["turns 1 mm"](), acceleration, jerk).slowed == ()


def hook(width, rate, length=0.02):
    """Legs that move evenly and, within the last micrometres, ever faster: up to `rate` metres for each metre."""
    slope = np.array([1.0, 0.8, -0.6, 0.3, -0.9])

    def legs(s, order):
        bent = rate * width ** (1 - order) * np.exp((s - length) / width)
        return (
            np.outer(0.0 * s if order > 1 else s if order == 0 else 1.0 + 0.0 * s, slope)
            + np.outer(bent, np.roll(slope, 1))
            + (0.8 if order == 0 else 0.0)
        )

    knots = np.concatenate([np.linspace(0.0, length, 41)[1:-1], length - width * np.arange(12.0, 0.0, -1.0)])
    return Known(legs, length, 0.05, inner_knots=knots)


def test_bend_beside_a_rest_does_not_slow_the_whole_piece():
    piece = hook(2e-6, 100.0)
    durations = [timed(piece, acceleration, 200.0).duration for acceleration in (5.0, 10.0, 50.0)]
    assert (np.diff(durations) <= 1e-3 * durations[0] + 1e-3).all(), durations


def bend(width, curvature, fades=2e-4, length=0.02):
    """Legs along a line whose curvature rises within `width` metres, between path knots, and then fades."""
    slope, begin = np.array([0.5, 0.4, -0.3, 0.15, -0.45]), 0.5 * length + 1.3e-5

    def legs(s, order):
        u, t = np.clip((s - begin) / width, 0.0, 1.0), np.maximum(s - begin - width, 0.0)
        left = np.exp(-t / fades)
        offset = width**2 * u**3 / 6.0 + width / 2.0 * t + fades * (t - fades * (1.0 - left))
        heading = width * u**2 / 2.0 + fades * (1.0 - left)
        third = np.where(u <= 0.0, 0.0, np.where(u < 1.0, 1.0 / width, -left / fades))
        bent = curvature * (offset, heading, np.where(u < 1.0, u, left), third)[order]
        along = (0.8 + np.outer(s, slope), np.tile(slope, (len(s), 1)), 0.0, 0.0)[order]
        return along + np.outer(bent, np.roll(slope, 1) / 0.5)

    return Known(legs, length, 0.025, inner_knots=np.linspace(0.0, length, 41)[1:-1])


def test_bend_between_gridpoints_slows_the_law_about_there_alone():
    """A law that does not see it is slowed afterwards, twice as widely (67 ms)."""
    trajectory = timed(bend(2e-6, 960.0), 5.0, 200.0)
    times = np.arange(0.1, trajectory.duration - 0.1, 1e-3)
    assert 0 < (trajectory.station(times, 1) < 0.98 * 0.025).sum() <= 35


def test_third_derivatives_see_bends_between_stations():
    piece, s = bend(2e-6, 960.0), np.linspace(0.0099, 0.0101, 11)
    second, third = piece(s, 2), piece(s, 3)
    seen = third_derivatives(s, second, third)
    k = 5  # the bend lies in the stage after this station
    mean = (second[k + 1] - second[k]) / (s[k + 1] - s[k])
    assert np.abs(third).max() < 0.5 * np.abs(mean).max()
    assert seen[k : k + 2] == pytest.approx(np.stack([mean, mean]))
    others = np.delete(np.arange(11), [k, k + 1])
    assert (seen[others] == third[others]).all()
