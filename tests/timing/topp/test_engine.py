"""Passes of both engines: any scale of units, failures as values, the ceiling of x."""

import logging

import numpy as np
import pytest
from timing_paths import Piece

from pentapod.timing.limits.leg_acceleration import LegAcceleration
from pentapod.timing.limits.leg_velocity import LegVelocity
from pentapod.timing.path.path import PathDerivatives
from pentapod.timing.topp.engine import fastest
from pentapod.timing.topp.stages import Failure


@pytest.mark.parametrize("length", [1e-9, 1e-6, 1e-3, 1.0, 1e3])
@pytest.mark.parametrize("limit", [1e-3, 1.0, 1e3])
def test_bang_bang_at_any_scale(length, limit):
    """One leg, no curvature: x rises and falls with slope 2 a. Scales at which toppra itself gives up."""
    s = np.linspace(0, length, 41)
    rows = np.zeros((41, 5))
    rows[:, 1] = 1 / limit
    x = fastest(s, rows, 0 * rows, np.full(41, 1e9 * limit * length))
    assert not isinstance(x, Failure)
    assert np.allclose(x, 2 * limit * np.minimum(s, length - s), rtol=1e-5, atol=1e-6 * limit * length)


def test_failures_are_values_and_silent(caplog, recwarn):
    s = np.linspace(0, 1, 21)
    rows = np.ones((21, 5))
    bend = np.zeros((21, 5))
    bend[10] = np.nan
    with caplog.at_level(logging.DEBUG):
        result = fastest(s, rows, bend, np.ones(21))
    assert isinstance(result, Failure)
    assert not caplog.records
    assert not recwarn.list


@pytest.mark.slow
def test_ceiling_is_the_largest_x_with_a_common_acceleration():
    rng = np.random.default_rng(3)
    fast, hard = rng.uniform(0.1, 1, 5), rng.uniform(1, 9, 5)
    limits = LegVelocity(fast, fast), LegAcceleration(hard, hard, np.ones(5))
    first, second = rng.normal(size=(300, 5)), 10 * rng.normal(size=(300, 5))
    path = PathDerivatives(Piece(lambda s: (0.0 * first, first, second), 1.0), np.zeros(300))
    x = np.minimum(np.min([limit.ceiling(path) for limit in limits], axis=0), 0.7**2)

    def room(x):  # by brute force over u
        u = np.linspace(-60, 60, 20_001)
        push = np.abs(first[:, None] * u[:, None] + second[:, None] * x[:, None, None]) / hard
        fits = (push.max(2) <= 1.0).any(1) & (x <= 0.49 * 1.0001)
        return fits & (np.abs(first) * np.sqrt(x)[:, None] <= fast * 1.0001).all(1)

    assert room(0.99 * x).all()
    assert not room(1.01 * x).any()
