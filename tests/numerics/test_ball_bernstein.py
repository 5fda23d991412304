"""Polynomials of high degree with balls as coefficients: against exact rational arithmetic."""

from fractions import Fraction
from math import comb

import numpy as np
import pytest

from pentapod.base.errors import ArrayError
from pentapod.numerics.ball_bernstein import elevate, multiply
from pentapod.numerics.balls import Ball


def exact_product(a: list[float], b: list[float]) -> list[Fraction]:
    n, m = len(a) - 1, len(b) - 1
    out = [Fraction(0)] * (n + m + 1)
    for j, x in enumerate(a):
        for k, y in enumerate(b):
            out[j + k] += Fraction(x) * Fraction(y) * comb(n, j) * comb(m, k)
    return [c / comb(n + m, j) for j, c in enumerate(out)]


@pytest.mark.parametrize(("n", "m"), [(3, 5), (28, 28), (29, 29), (0, 61), (40, 37)])
def test_products_contain_the_exact_ones(n: int, m: int) -> None:
    rng = np.random.default_rng(n + m)
    a, b = rng.normal(size=n + 1), rng.normal(size=m + 1)
    for found, exact in (
        (multiply(Ball.exact(a), Ball.exact(b)), exact_product(a.tolist(), b.tolist())),
        (elevate(Ball.exact(a), m), exact_product(a.tolist(), [1.0] * (m + 1))),
    ):
        for low, high, value in zip(found.lower.tolist(), found.upper.tolist(), exact, strict=True):
            assert Fraction(low) <= value <= Fraction(high)


def test_degrees_whose_binomials_are_no_numbers_are_refused() -> None:
    many = Ball.exact(np.ones(600))
    with pytest.raises(ArrayError, match="degree"):
        multiply(many, many)
