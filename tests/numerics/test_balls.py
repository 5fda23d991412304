"""Ball arithmetic against exact rational numbers: the exact result is inside, and the ball is not much too large."""

import operator
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pentapod.numerics.balls import Ball

OPERATIONS = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv}

numbers = st.floats(-1e9, 1e9, allow_nan=False) | st.floats(-1e-150, 1e-150) | st.integers(-3, 3).map(float)
radii = st.just(0.0) | st.floats(0.0, 10.0) | st.floats(0.0, 1e-12)
shares = st.fractions(-1, 1, max_denominator=64)


@st.composite
def member(draw) -> tuple[Ball, Fraction]:
    """A ball and an exact number in it."""
    mid, rad = draw(numbers), draw(radii)
    return Ball(np.array(mid), np.array(rad)), Fraction(mid) + draw(shares) * Fraction(rad)


def contains(ball: Ball, exact: Fraction) -> bool:
    mid, rad = float(ball.mid), float(ball.rad)
    return not (np.isfinite(mid) and np.isfinite(rad)) or abs(Fraction(mid) - exact) <= Fraction(rad)


@given(member(), st.lists(st.tuples(st.sampled_from("+-*/"), member(), st.booleans()), min_size=1, max_size=6))
def test_a_chain_of_operations_contains_the_exact_result(start, steps):
    ball, exact = start
    with np.errstate(all="ignore"):
        for symbol, (other, other_exact), swapped in steps:
            left, right = ((other, other_exact), (ball, exact)) if swapped else ((ball, exact), (other, other_exact))
            if symbol == "/" and right[1] == 0:
                return
            ball = OPERATIONS[symbol](left[0], right[0])
            exact = OPERATIONS[symbol](left[1], right[1])
            assert contains(ball, exact)


@given(member(), numbers, st.sampled_from("+-*/"), st.booleans())
def test_plain_numbers_and_arrays_are_exact_operands(start, plain, symbol, swapped):
    ball, exact = start
    operands = (plain, ball) if swapped else (ball, plain)
    truths = (Fraction(plain), exact) if swapped else (exact, Fraction(plain))
    if symbol == "/" and truths[1] == 0:
        return
    with np.errstate(all="ignore"):
        result = OPERATIONS[symbol](*operands)
        as_array = OPERATIONS[symbol](*(np.array(o) if isinstance(o, float) else o for o in operands))
    assert contains(result, OPERATIONS[symbol](*truths))
    assert np.array_equal(result.mid, as_array.mid, equal_nan=True)
    assert np.array_equal(result.rad, as_array.rad, equal_nan=True)


@given(st.floats(0.0, 1e9), radii, shares)
def test_square_roots(mid, rad, share):
    exact = Fraction(mid) + share * Fraction(rad)
    with np.errstate(all="ignore"):
        root = Ball(np.array(mid), np.array(rad)).sqrt()
    if mid < rad:
        assert not np.isfinite(root.rad) or mid == rad
        return
    if np.isfinite(root.rad):
        low, high = (
            Fraction(float(root.mid)) - Fraction(float(root.rad)),
            Fraction(float(root.mid)) + Fraction(float(root.rad)),
        )
        assert max(low, 0) ** 2 <= exact <= high**2


@given(member(), member(), shares)
def test_between_contains_both_and_what_is_between(first, second, share):
    weight = (share + 1) / 2
    hull = Ball.between(first[0], second[0])
    for exact in (first[1], second[1], first[1] + weight * (second[1] - first[1])):
        assert contains(hull, exact)
    assert contains(first[0].widened(0.25), first[1] + Fraction(1, 4) * share)


@given(member())
def test_bounds_and_magnitude(start):
    ball, exact = start
    assert Fraction(float(ball.lower)) <= exact <= Fraction(float(ball.upper))
    assert abs(exact) <= Fraction(float(ball.magnitude))


@pytest.mark.parametrize("inner", [1, 2, 6, 12])
def test_matrix_products_contain_the_exact_result(inner):
    rng = np.random.default_rng(inner)
    matrix = rng.normal(size=(40, 3, inner)) * 10.0 ** rng.integers(-9, 9, (40, 3, inner))
    mid = rng.normal(size=(40, inner, 2)) * 10.0 ** rng.integers(-9, 9, (40, inner, 2))
    rad = np.abs(mid) * 10.0 ** rng.integers(-17, 0, mid.shape) * rng.integers(0, 2, mid.shape)
    signs = rng.integers(-1, 2, mid.shape)
    product = matrix @ Ball(mid, rad)
    for n, row, column in np.ndindex(product.mid.shape):
        exact = sum(
            Fraction(matrix[n, row, k])
            * (Fraction(mid[n, k, column]) + int(signs[n, k, column]) * Fraction(rad[n, k, column]))
            for k in range(inner)
        )
        assert contains(product[n, row, column], exact)


def test_the_balls_are_tight():
    rng = np.random.default_rng(0)
    a, b = rng.uniform(1, 2, 1000), rng.uniform(1, 2, 1000)
    for symbol, operation in OPERATIONS.items():
        result = operation(Ball.exact(a), Ball.exact(b))
        assert (result.rad <= 1.01 * 2.0**-53 * np.abs(result.mid) + 1e-299).all(), symbol
        wide = operation(Ball(a, 1e-6 * a), Ball(b, 1e-6 * b))
        assert (wide.rad <= 2.001e-6 * 2.0 * np.maximum(np.abs(wide.mid), 2.0)).all(), symbol
    assert (Ball(a, 1e-6 * a).sqrt().rad <= 0.501e-6 * np.sqrt(a)).all()


def test_what_has_no_value_proves_nothing():
    with np.errstate(all="ignore"):
        through_zero = 1.0 / Ball(np.array(0.5), np.array(0.5))
        negative = Ball(np.array(0.5), np.array(0.6)).sqrt()
        overflow = Ball.exact(1e200) * 1e200
    for ball in (through_zero, negative, overflow):
        assert not ball.magnitude < np.inf


def test_where_and_indices():
    ball = Ball(np.arange(6.0).reshape(2, 3), np.full((2, 3), 0.5))
    masked = ball.where(np.array([True, False, True]))
    assert masked.mid.tolist() == [[0, 0, 2], [3, 0, 5]]
    assert masked.rad.tolist() == [[0.5, 0, 0.5]] * 2
    assert ball[1, 2].mid == 5.0
    assert (-ball)[0].mid.tolist() == [0, -1, -2]
