"""Lower bounds against exact arithmetic and against companion-matrix minima."""

import numpy as np
from numpy.polynomial import Polynomial

from pentapod.geometry import from_power, lower_bounds


def true_minimum(powers: np.ndarray) -> float:
    polynomial = Polynomial(powers)
    stationary = polynomial.deriv().roots()
    inside = stationary.real[(abs(stationary.imag) < 1e-6) & (stationary.real > 0) & (stationary.real < 1)]
    return float(min(polynomial(np.r_[0.0, 1.0, inside])))


def bounds(powers: np.ndarray, depth: int = 20, error: float = 1e-13) -> np.ndarray:
    n = len(powers)
    return lower_bounds(from_power(powers), np.full(n, error), np.full(n, 1e-15), depth)


def test_never_above_the_minimum_and_decided_where_there_is_room() -> None:
    rng = np.random.default_rng(3)
    powers = rng.normal(size=(2000, 7)) * 4.0
    powers[:, 0] += 2.0
    minima = np.array([true_minimum(p) for p in powers])
    low = bounds(powers)
    assert (low <= np.maximum(minima, 0.0) + 1e-12).all()
    assert ((low > 0.0) == (minima > 1e-9)).all()
    assert 0.05 < (low > 0.0).mean() < 0.95


def test_a_double_root_is_not_positive_and_subdivision_finds_how_near_is_near() -> None:
    # (t − 1/3)² + gap: the coefficients alone do not show that it is positive
    for gap, depth, proven in [(0.0, 40, False), (-1e-9, 40, False), (1e-9, 40, True), (1e-9, 3, False)]:
        low = bounds(np.array([[1 / 9 + gap, -2 / 3, 1.0]]), depth)
        assert (low[0] > 0.0) == proven
        assert low[0] <= max(gap, 0.0)


def test_an_end_at_zero_within_the_error_is_refused_at_once() -> None:
    assert bounds(np.array([[0.0, 1.0]]))[0] == 0.0
    assert bounds(np.array([[1e-14, 1.0]]))[0] == 0.0
    assert bounds(np.array([[1.0, -1.0]]))[0] == 0.0
    assert bounds(np.array([[1e-6, 1.0]]))[0] > 0.9e-6


def test_what_is_not_finite_proves_nothing_and_does_not_infect_its_neighbours() -> None:
    low = bounds(np.array([[np.nan, 1.0], [2.0, 1.0], [np.inf, -1.0]]))
    np.testing.assert_allclose(low, [0.0, 2.0, 0.0], atol=1e-12)
    assert bounds(np.empty((0, 4))).shape == (0,)
