"""Double-double arithmetic: numbers with about 32 digits, in batches, as unevaluated sums of two doubles.

For the few places where an ordinary double has lost its digits by cancellation. Sources: D. E. Knuth, The Art of
Computer Programming, vol. 2, section 4.2.2 (two_sum); T. J. Dekker, "A floating-point technique for extending
the available precision", Numerische Mathematik 18 (1971) (two_product). No fused multiply-add is needed: sums and
products of doubles are the same on every machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from pentapod.base.arrays import Floats

_SPLITTER = 2.0**27 + 1.0


@dataclass(frozen=True, eq=False)
class DoubleDouble:
    """The numbers high + low (...), |low| at most half a unit in the last place of high; relative error 2⁻¹⁰²."""

    high: Floats
    low: Floats

    __array_ufunc__ = None  # NumPy arrays leave `array * number` to this class

    @classmethod
    def table(cls, exact: Sequence[Sequence[Fraction]]) -> DoubleDouble:
        """Return the numbers (n, m) nearest to n rows of m fractions."""
        high = [[float(entry) for entry in row] for row in exact]
        low = [[float(e - Fraction(h)) for e, h in zip(*rows, strict=True)] for rows in zip(exact, high, strict=True)]
        return cls(np.array(high), np.array(low))

    def __add__(self, other: DoubleDouble | Floats | float) -> DoubleDouble:
        high, low = _parts(other)
        total, error = two_sum(self.high, high)
        rest, rest_error = two_sum(self.low, low)
        total, error = _quick_two_sum(total, error + rest)
        return DoubleDouble(*_quick_two_sum(total, error + rest_error))

    def __neg__(self) -> DoubleDouble:
        return DoubleDouble(-self.high, -self.low)

    def __sub__(self, other: DoubleDouble | Floats | float) -> DoubleDouble:
        high, low = _parts(other)
        return self + DoubleDouble(-high, -low)

    def __rsub__(self, other: Floats | float) -> DoubleDouble:
        return -self + other

    def __mul__(self, other: DoubleDouble | Floats | float) -> DoubleDouble:
        high, low = _parts(other)
        product, error = two_product(self.high, high)
        return DoubleDouble(*_quick_two_sum(product, error + (self.high * low + self.low * high)))

    __radd__ = __add__
    __rmul__ = __mul__


def two_sum(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Return the rounded sum (...) and its exact rounding error."""
    total = a + b
    share = total - a
    return total, (a - (total - share)) + (b - share)


def two_product(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Return the rounded product (...) and its exact rounding error, for factors below 1e290."""
    product = a * b
    (a1, a2), (b1, b2) = _split(a), _split(b)
    return product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2


def _quick_two_sum(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """As `two_sum`, for |a| ≥ |b|."""
    total = a + b
    return total, b - (total - a)


def _split(a: Floats) -> tuple[Floats, Floats]:
    """Return two halves of 26 digits each with sum a: their products are exact."""
    spread = _SPLITTER * a
    high = spread - (spread - a)
    return high, a - high


def _parts(value: DoubleDouble | Floats | float) -> tuple[Floats, Floats]:
    if isinstance(value, DoubleDouble):
        return value.high, value.low
    high = np.asarray(value, dtype=np.float64)
    return high, np.zeros_like(high)
