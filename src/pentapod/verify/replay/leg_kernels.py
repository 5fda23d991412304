"""Extremes of the legs on the controller's polynomials, and the halves of these, compiled."""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.kernels import kernel


@kernel
def halve(bernstein: Floats, halves: Floats, samples: Floats) -> None:
    """Fill both halves (2 N, d, k + 1) of polynomials (N, d, k + 1), k ≤ 3, and samples (2 N + 1, d) at their ends."""
    count, columns, n = bernstein.shape
    work = np.empty(n)
    for i in range(count):
        for j in range(columns):
            work[:] = bernstein[i, j]
            for k in range(n):
                halves[2 * i, j, k] = work[0]
                for m in range(n - 1 - k):
                    work[m] = 0.5 * (work[m] + work[m + 1])
            # What is left over, from the end, are the coefficients of the other half.
            for k in range(n):
                halves[2 * i + 1, j, k] = work[k]
            samples[2 * i, j], samples[2 * i + 1, j] = bernstein[i, j, 0], work[0]
            samples[2 * i + 2, j] = bernstein[i, j, n - 1]


@kernel
def extremes(wide: Floats, first: int, last: int, number: int, period: float, values: Floats, at: Ints) -> None:
    """Raise values (m, d) to the largest measures of intervals first to last of polynomials (N, d, k + 1), k 1 or 3.

    at (m, d): becomes their intervals, or rows, counted from `number` on; of equal ones the first counts. The measures
    are the negative least value, the largest, the largest |rate|, |acceleration| at the rows, |jerk|; as those of
    `Interpolant`, at rest before the first polynomial and after the last.
    """
    count, columns = wide.shape[0], wide.shape[1]
    found = np.empty(len(values))
    for j in range(columns):
        before = _acceleration(wide, first, j, period)
        for i in range(first, last + 1):
            after = before
            if i < last:
                after = _acceleration(wide, i + 1, j, period)
                low, high = _range(wide[i, j])
                found[0], found[1], found[2] = -low, high, _rate(wide[i, j], period)
                jerk = abs(after - before)
                if i == 0:
                    jerk = max(jerk, abs(before))
                if i == count - 1:
                    jerk = max(jerk, abs(after))
                found[4] = jerk / period
            found[3] = abs(before)
            for k in range(len(values)):
                if (i < last or k == 3) and found[k] > values[k, j]:
                    values[k, j], at[k, j] = found[k], number + i - first
            before = after


@kernel
def _acceleration(wide: Floats, row: int, j: int, period: float) -> float:
    """Return the acceleration at a row: of the polynomials on both sides the larger one, which differ by rounding.

    Of lines the change of their rates over the period.
    """
    count, n = len(wide), wide.shape[2]
    square = period**2
    if n == 2:
        rate = wide[row, j, 1] - wide[row, j, 0] if row < count else 0.0
        return (rate - (wide[row - 1, j, 1] - wide[row - 1, j, 0] if row > 0 else 0.0)) / square
    after, before = 0.0, 0.0
    if row < count:
        after = 2.0 * (3.0 * (wide[row, j, 2] - wide[row, j, 1]) - 3.0 * (wide[row, j, 1] - wide[row, j, 0])) / square
    if row > 0:
        end = wide[row - 1, j]
        before = 2.0 * (3.0 * (end[3] - end[2]) - 3.0 * (end[2] - end[1])) / square
    return before if row == count or abs(before) > abs(after) else after


@kernel
def _range(b: Floats) -> tuple[float, float]:
    """Return the least and the largest value of a line or a cubic (k + 1,)."""
    n = len(b)
    low, high = min(b[0], b[n - 1]), max(b[0], b[n - 1])
    if n == 2:
        return low, high
    d0, d1, d2 = 3.0 * (b[1] - b[0]), 3.0 * (b[2] - b[1]), 3.0 * (b[3] - b[2])
    if min(d0, d1, d2) >= 0.0 or max(d0, d1, d2) <= 0.0:
        return low, high
    bend, half = d0 - 2.0 * d1 + d2, d1 - d0
    square = half * half - bend * d0
    if square < 0.0:
        return low, high
    # The two quotients without cancellation.
    q = -(half + math.copysign(math.sqrt(square), half))
    for t in (q / bend, d0 / q):
        if 0.0 < t < 1.0:
            s = 1.0 - t
            value = s**3 * b[0] + 3.0 * s * s * t * b[1] + 3.0 * s * t * t * b[2] + t**3 * b[3]
            low, high = min(low, value), max(high, value)
    return low, high


@kernel
def _rate(b: Floats, period: float) -> float:
    """Return the largest |rate| of a line or a cubic (k + 1,)."""
    if len(b) == 2:
        return abs((b[1] - b[0]) / period)
    d0, d1, d2 = 3.0 * (b[1] - b[0]) / period, 3.0 * (b[2] - b[1]) / period, 3.0 * (b[3] - b[2]) / period
    speed = max(abs(d0), abs(d2))
    # Only a rate whose middle coefficient is beyond both ends can have its maximum in between.
    if abs(d1) > speed:
        t = (d0 - d1) / (d0 - 2.0 * d1 + d2)
        if 0.0 < t < 1.0:
            speed = max(speed, abs((1.0 - t) ** 2 * d0 + 2.0 * t * (1.0 - t) * d1 + t * t * d2))
    return speed
