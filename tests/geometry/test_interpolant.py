"""Interpolant: exact extrema of what a controller makes of rows, against scipy's splines and dense samples."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly, CubicSpline

from pentapod.geometry.interpolant import Interpolant, largest_length

PERIOD = 0.25


def test_interpolant_extrema_of_a_random_spline():
    """A wild spline, where extrema lie between the rows: dense sampling never exceeds them, and comes close."""
    rows = 0.6 + 0.1 * np.random.default_rng(5).standard_normal((40, 5))
    motion = Interpolant.through(rows, PERIOD, "cubic")
    spline = CubicSpline(np.arange(40) * PERIOD, rows, axis=0, bc_type="clamped")
    fine = np.linspace(0.0, 1.0, 400)
    times = (np.arange(39)[:, None] + fine).reshape(-1) * PERIOD
    values, rates, accelerations = (spline(times, order).reshape(39, 400, 5) for order in range(3))
    low, high = motion.ranges
    assert (low <= values.min(axis=1) + 1e-12).all()
    assert (high >= values.max(axis=1) - 1e-12).all()
    np.testing.assert_allclose(low, values.min(axis=1), atol=1e-5)
    np.testing.assert_allclose(high, values.max(axis=1), atol=1e-5)
    np.testing.assert_allclose(motion.rates, np.abs(rates).max(axis=1), rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(motion.accelerations.max(axis=0), np.abs(accelerations).max(axis=(0, 1)), rtol=1e-6)
    np.testing.assert_allclose(motion.first, spline(np.arange(40) * PERIOD, 1), atol=1e-12)
    np.testing.assert_allclose(motion.second, spline(np.arange(40) * PERIOD, 2), atol=1e-9)
    middle = np.abs(spline((np.arange(39) + 0.5) * PERIOD, 3))
    np.testing.assert_allclose(motion.jerks[1:-1], middle[1:-1], rtol=1e-9)


def test_steps_of_the_acceleration_at_the_ends_count_over_one_period():
    rows = np.array([[0.0], [1.0], [1.0], [1.0], [1.0]])
    motion = Interpolant.through(rows, PERIOD, "cubic")
    start = CubicSpline(np.arange(5) * PERIOD, rows, axis=0, bc_type="clamped")([0.0], 2)[0, 0]
    assert motion.jerks[0, 0] >= start / PERIOD


def test_interpolant_of_lines_by_hand():
    rows = np.full((4, 5), 0.5)
    rows[:, 2] += [0.0, 1e-6, 3e-6, 3e-6]
    motion = Interpolant.through(rows, 1e-3, "linear")
    # Steps 0 | 1, 2, 0 | 0 micrometres.
    np.testing.assert_allclose(motion.rates[:, 2], [1e-3, 2e-3, 0.0], atol=1e-12)
    np.testing.assert_allclose(motion.first[:, 2], [0.0, 1e-3, 2e-3, 0.0], atol=1e-12)
    np.testing.assert_allclose(motion.accelerations[:, 2], [1.0, 1.0, 2.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(motion.second[:, 2], [1.0, 1.0, -2.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(motion.jerks[:, 2], [1e3, 3e3, 2e3], atol=1e-5)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 6))
def test_largest_length_is_the_maximum(seed, degree):
    vectors = np.random.default_rng(seed).normal(size=(7, 3, degree + 1))
    value, where = largest_length(vectors)
    t = np.linspace(0.0, 1.0, 4001)
    dense = np.linalg.norm(BPoly(np.moveaxis(vectors, -1, 0)[:, None], [0.0, 1.0])(t), axis=-1).T
    assert value >= dense.max() - 1e-12
    assert value == pytest.approx(dense.max(), rel=1e-6)
    assert dense[where].max() == pytest.approx(value, rel=1e-6)


def test_largest_length_of_zero_vectors_is_zero():
    assert largest_length(np.zeros((3, 3, 3))) == (0.0, 0)
