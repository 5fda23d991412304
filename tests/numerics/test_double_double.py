"""Double-double arithmetic against fractions."""

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pentapod.numerics.double_double import DoubleDouble, two_product, two_sum

numbers = st.floats(-1e6, 1e6, allow_subnormal=False).filter(lambda x: x == 0.0 or abs(x) > 1e-6)


def exact(number: DoubleDouble) -> Fraction:
    return Fraction(np.asarray(number.high).item()) + Fraction(np.asarray(number.low).item())


@given(numbers, numbers)
def test_sums_and_products_of_doubles_are_exact(a: float, b: float) -> None:
    total, error = two_sum(np.float64(a), np.float64(b))
    assert Fraction(float(total)) + Fraction(float(error)) == Fraction(a) + Fraction(b)
    product, error = two_product(np.float64(a), np.float64(b))
    assert Fraction(float(product)) + Fraction(float(error)) == Fraction(a) * Fraction(b)


@given(numbers, numbers, numbers, numbers)
def test_operations_keep_a_hundred_bits(a: float, b: float, c: float, d: float) -> None:
    x = DoubleDouble.table([[Fraction(a) / 3]])
    y = DoubleDouble.table([[Fraction(b) / 7 + Fraction(c)]])
    left, right = Fraction(a) / 3, Fraction(b) / 7 + Fraction(c)
    size, tiny = max(abs(left), abs(right), abs(Fraction(d)), Fraction(1, 10**6)), Fraction(1, 2**100)
    assert abs(exact(x) - left) <= size * tiny
    assert abs(exact(x + y) - (left + right)) <= 4 * size * tiny
    assert abs(exact(x - y) - (left - right)) <= 4 * size * tiny
    assert abs(exact(d - x) - (Fraction(d) - left)) <= 4 * size * tiny
    assert abs(exact(x * y) - left * right) <= 8 * size * size * tiny
    assert abs(exact(np.array([d]) * x) - left * Fraction(d)) <= 8 * size * size * tiny
