"""Lower bounds against exact arithmetic and against companion-matrix minima."""

import numpy as np
from numpy.polynomial import Polynomial

from pentapod.numerics.bernstein import from_power
from pentapod.numerics.positivity import Positivity, positivity


def true_minimum(powers: np.ndarray) -> float:
    polynomial = Polynomial(powers)
    stationary = polynomial.deriv().roots()
    inside = stationary.real[(abs(stationary.imag) < 1e-6) & (stationary.real > 0) & (stationary.real < 1)]
    return float(min(polynomial(np.r_[0.0, 1.0, inside])))


def answer(powers: np.ndarray, depth: int = 20, error: float = 1e-13, rounding: float | None = None) -> Positivity:
    n = len(powers)
    own = None if rounding is None else np.full(n, rounding)
    return positivity(from_power(powers), np.full(n, error), np.full(n, 1e-15), depth, own)


def bounds(powers: np.ndarray, depth: int = 20, error: float = 1e-13) -> np.ndarray:
    return answer(powers, depth, error).low


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


def test_an_end_at_zero_within_the_error_is_not_positive() -> None:
    assert bounds(np.array([[0.0, 1.0]]))[0] == 0.0
    assert bounds(np.array([[1e-14, 1.0]]))[0] == 0.0
    assert bounds(np.array([[1.0, -1.0]]))[0] == 0.0
    assert bounds(np.array([[1e-6, 1.0]]))[0] > 0.9e-6


def test_what_is_not_finite_proves_nothing_and_does_not_infect_its_neighbours() -> None:
    low = bounds(np.array([[np.nan, 1.0], [2.0, 1.0], [np.inf, -1.0]]))
    np.testing.assert_allclose(low, [0.0, 2.0, 0.0], atol=1e-12)
    assert bounds(np.empty((0, 4))).shape == (0,)


def test_three_answers_and_where() -> None:
    # roots of (t − a)² + gap, of a line, and zero throughout
    powers = np.array([[1 / 9, -2 / 3, 1.0], [1 / 9 - 1e-6, -2 / 3, 1.0], [1e-15, 0.0, 1.0], [0.0, 0.0, 0.0]])
    powers = np.concatenate([powers, [[0.25, -1.0, 0.0], [2.0, 0.0, 0.0]]])
    found = answer(powers)
    np.testing.assert_array_equal(found.refuted, [False, True, False, False, True, False])
    np.testing.assert_array_equal(found.low > 0.0, [False] * 5 + [True])
    np.testing.assert_array_equal(np.isnan(found.doubt).any(axis=1), found.low > 0.0)
    for k, root in ((0, 1 / 3), (1, 1 / 3), (2, 0.0), (4, 0.25)):
        assert found.doubt[k, 0] <= root + 1e-3
        assert found.doubt[k, 1] >= root
    assert np.ptp(found.doubt[0]) < 1e-4
    assert np.ptp(found.doubt[2]) < 1e-4
    np.testing.assert_array_equal(found.doubt[3], [0.0, 1.0])


def test_a_wide_error_leaves_undecided_what_rounding_alone_does_not_refute() -> None:
    powers = np.array([[1e-4, 0.0], [-1e-4, 0.0]])
    found = answer(powers, error=1e-3, rounding=1e-12)
    np.testing.assert_array_equal(found.low, 0.0)
    np.testing.assert_array_equal(found.refuted, [False, True])
    np.testing.assert_array_equal(answer(powers, error=1e-3).refuted, [False, False])


def test_outside_the_doubtful_part_it_is_positive() -> None:
    rng = np.random.default_rng(7)
    powers = rng.normal(size=(500, 6))
    powers[:, 0] += 1.5
    found = answer(powers, error=1e-2, rounding=1e-12)
    t = np.linspace(0.0, 1.0, 401)
    values = Polynomial.__call__
    for row, doubt, refuted in zip(powers, found.doubt, found.refuted, strict=True):
        y = values(Polynomial(row), t)
        assert refuted == (true_minimum(row) < -1e-11)
        if not refuted:
            assert (y[~((t >= doubt[0]) & (t <= doubt[1]))] > 0.0).all()
