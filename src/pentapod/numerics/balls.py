"""Ball arithmetic on arrays: midpoint ± radius, whose radius bounds every rounding.

A `Ball` encloses an unknown exact number, or every number of a range: whatever the operands' exact values are, the
exact result lies in the result's ball. So a bound read off a computed ball is a proof. The midpoints are computed as
usual; each operation adds its own rounding, at most u |result| with u = 2⁻⁵³ (IEEE 754, rounding to nearest), to the
radius, and radii are enlarged by more than their own roundings (lemma 5 of docs/proofs.md). Overflow makes radii
infinite or NaN, and such balls prove nothing: write `x < bound`, never `not x >= bound`.

Source: S. M. Rump, "Fast and parallel interval arithmetic", BIT 39 (1999), on midpoint-radius arithmetic.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, TypeAlias

import numpy as np

from pentapod.base.arrays import Bools, Floats

ROUND_UP = 1.0 + 2.0**-48
"""Factor that exceeds up to 30 roundings of a radius."""

_U = 2.0**-53
_TINY = 1e-300  # covers every underflow

Number: TypeAlias = "Ball | Floats | float"


@dataclass(frozen=True, slots=True, eq=False)
class Ball:
    """All numbers within `rad` of `mid`: arrays of one shape (...), or that broadcast to it."""

    mid: Floats
    rad: Floats

    __array_ufunc__: ClassVar[None] = None  # array + ball is the ball's business

    @classmethod
    def exact(cls, value: Floats | float) -> Ball:
        """Return the ball of radius 0."""
        mid = np.asarray(value, dtype=np.float64)
        return cls(mid, np.zeros_like(mid))

    @classmethod
    def between(cls, a: Number, b: Number) -> Ball:
        """Return the smallest ball, but for rounding, that contains two numbers and all between them."""
        first, second = _ball(a), _ball(b)
        low = np.minimum(first.lower, second.lower)
        high = np.maximum(first.upper, second.upper)
        mid = 0.5 * (low + high)
        return cls(mid, np.maximum(high - mid, mid - low) * ROUND_UP + _TINY)

    @property
    def lower(self) -> Floats:
        """A number that none in the ball is below."""
        return np.nextafter(self.mid - self.rad, -np.inf)

    @property
    def upper(self) -> Floats:
        """A number that none in the ball is above."""
        return np.nextafter(self.mid + self.rad, np.inf)

    @property
    def magnitude(self) -> Floats:
        """A number that no absolute value in the ball exceeds."""
        return (np.abs(self.mid) + self.rad) * ROUND_UP

    def widened(self, by: Floats | float) -> Ball:
        """Return the ball with a radius larger by `by` ≥ 0."""
        return Ball(self.mid, (self.rad + by) * ROUND_UP + _TINY)

    def where(self, mask: Bools) -> Ball:
        """Return these balls where the mask holds, and exactly 0 elsewhere."""
        return Ball(np.where(mask, self.mid, 0.0), np.where(mask, self.rad, 0.0))

    def sqrt(self) -> Ball:
        """Return the square roots. NaN where the ball contains a negative number."""
        mid = np.sqrt(self.mid)
        # |√a − √m| = |a − m| / (√a + √m)
        spread = self.rad / (mid + np.sqrt(np.nextafter(self.mid - self.rad, -np.inf)))
        return Ball(mid, (np.where(self.rad == 0.0, 0.0, spread) + _U * mid) * ROUND_UP + _TINY)

    def __getitem__(self, key: object) -> Ball:
        return Ball(self.mid[key], self.rad[key])  # type: ignore[index]

    def __neg__(self) -> Ball:
        return Ball(-self.mid, self.rad)

    def __add__(self, other: Number) -> Ball:
        b = _ball(other)
        mid = self.mid + b.mid
        return Ball(mid, (self.rad + b.rad + _U * np.abs(mid)) * ROUND_UP + _TINY)

    def __radd__(self, other: Number) -> Ball:
        return self + other

    def __sub__(self, other: Number) -> Ball:
        return self + -_ball(other)

    def __rsub__(self, other: Number) -> Ball:
        return -self + other

    def __mul__(self, other: Number) -> Ball:
        b = _ball(other)
        mid = self.mid * b.mid
        rad = np.abs(self.mid) * b.rad + self.rad * (np.abs(b.mid) + b.rad)
        return Ball(mid, (rad + _U * np.abs(mid)) * ROUND_UP + _TINY)

    def __rmul__(self, other: Number) -> Ball:
        return self * other

    def __truediv__(self, other: Number) -> Ball:
        b = _ball(other)
        mid, size = self.mid / b.mid, np.abs(b.mid)
        # |a/b − m/n| ≤ (|m/n| rad b + rad a) / (|n| − rad b), the true quotient m/n within u of the computed one
        room = np.nextafter(size - b.rad, -np.inf)
        rad = (np.abs(mid) * b.rad + self.rad + _TINY) / np.where(room > 0.0, room, np.nan)
        return Ball(mid, (rad + _U * np.abs(mid)) * ROUND_UP + _TINY)

    def __rtruediv__(self, other: Number) -> Ball:
        return _ball(other) / self

    def __rmatmul__(self, matrix: Floats) -> Ball:
        """Return matrix (..., m, n) @ ball (..., n, k), n ≤ 12; the matrix's entries are exact."""
        sizes = np.abs(matrix)
        mid = matrix @ self.mid
        # n products and n − 1 sums, in any order, fused or not: within γ_n of the exact sum (Higham, section 3.1)
        rounding = (matrix.shape[-1] + 1) * _U
        return Ball(mid, (sizes @ (self.rad + rounding * np.abs(self.mid))) * ROUND_UP + _TINY)


def _ball(value: Number) -> Ball:
    return value if isinstance(value, Ball) else Ball.exact(value)
