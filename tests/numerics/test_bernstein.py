"""Bernstein polynomials against numpy.polynomial and scipy, and their laws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.interpolate import BPoly

from pentapod.numerics.bernstein import (
    convolve,
    elevate,
    from_power,
    multiply,
    scaled,
    split,
    unscaled,
)

T = np.linspace(0.0, 1.0, 33)
coefficients = st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=9).map(np.array)


def reference(c: np.ndarray, t: np.ndarray) -> np.ndarray:
    """scipy's value of the polynomial with coefficients (n + 1,) at t."""
    return BPoly(c[:, None], [0.0, 1.0])(t)


@given(coefficients, coefficients)
def test_multiply_multiplies_values(a: np.ndarray, b: np.ndarray) -> None:
    product = multiply(a, b)
    assert len(product) == len(a) + len(b) - 1
    np.testing.assert_allclose(reference(product, T), reference(a, T) * reference(b, T), atol=1e-10)
    np.testing.assert_allclose(product, multiply(b, a), atol=1e-12)


@given(coefficients, st.integers(0, 6))
def test_elevate_changes_no_value_and_tightens_the_hull(c: np.ndarray, by: int) -> None:
    higher = elevate(c, by)
    assert len(higher) == len(c) + by
    np.testing.assert_allclose(reference(higher, T), reference(c, T), atol=1e-11)
    assert higher.min() >= c.min() - 1e-12
    assert higher.max() <= c.max() + 1e-12


@given(coefficients, st.floats(0.05, 0.95))
def test_split_gives_both_halves(c: np.ndarray, at: float) -> None:
    for where in (0.5, at):
        left, right = split(c, where)
        np.testing.assert_allclose(reference(left, T), reference(c, where * T), atol=1e-11)
        np.testing.assert_allclose(reference(right, T), reference(c, where + (1 - where) * T), atol=1e-11)
        assert left[-1] == right[0]
        assert left[0] == c[0]
        assert right[-1] == c[-1]


@given(coefficients)
def test_power_form_agrees_with_numpy(c: np.ndarray) -> None:
    np.testing.assert_allclose(reference(from_power(c), T), Polynomial(c)(T), atol=1e-11)


def test_scaled_and_back() -> None:
    c = np.random.default_rng(0).normal(size=(7, 5))
    np.testing.assert_allclose(scaled(c), c * [1, 4, 6, 4, 1])
    np.testing.assert_allclose(unscaled(scaled(c)), c, rtol=1e-15)
    np.testing.assert_allclose(convolve(scaled(c[0]), scaled(c[1])), np.convolve(scaled(c[0]), scaled(c[1])))


def test_batches_broadcast() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(4, 1, 3)), rng.normal(size=(6, 5))
    product = multiply(a, b)
    assert product.shape == (4, 6, 7)
    np.testing.assert_allclose(product[2, 3], multiply(a[2, 0], b[3]), rtol=1e-13)
    np.testing.assert_allclose(multiply(b, a), product, rtol=1e-13)
    left, _ = split(product)
    assert left.shape == product.shape


@pytest.mark.parametrize("shape", [(0, 3), (2, 0, 4)])
def test_empty_batches_pass(shape: tuple) -> None:
    assert multiply(np.zeros(shape), np.zeros(shape)).shape == (*shape[:-1], 2 * shape[-1] - 1)
