"""Loss of time by keeping the limits at setpoints, and paths that bend hard right beside a rest."""

from dataclasses import replace

import numpy as np
import pytest
from limit_matrix import MATRIX, Known
from timing_paths import Path, machine

from pentapod.timing import Trajectory, certify, retime


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
