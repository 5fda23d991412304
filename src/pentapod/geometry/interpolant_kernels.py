"""Cubic splines through rows at equal periods, their rates and accelerations, compiled."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import kernel


@kernel
def spline_slopes(rows: Floats, slopes: Floats) -> None:
    """Fill slopes (N, d), per row, of the C2 cubic spline through rows (N, d) from rest to rest.

    C2 at each inner row: the slopes before, at and after it, weighted 1, 4, 1, sum to three times the rise.
    """
    last, factor = len(rows) - 1, np.zeros(len(rows))
    slopes[0], slopes[last] = 0.0, 0.0
    for i in range(1, last):
        factor[i] = 1.0 / (4.0 - factor[i - 1])
        for k in range(rows.shape[1]):
            slopes[i, k] = (3.0 * (rows[i + 1, k] - rows[i - 1, k]) - slopes[i - 1, k]) * factor[i]
    for i in range(last - 1, 0, -1):
        for k in range(rows.shape[1]):
            slopes[i, k] -= factor[i] * slopes[i + 1, k]


@kernel
def cubic_rates(bernstein: Floats, period: float, rates: Floats) -> None:
    """Fill rates (N − 1, d) with the largest |rate| of cubics (N − 1, d, 4) in Bernstein form, each over one period."""
    for i in range(len(bernstein)):
        for k in range(bernstein.shape[1]):
            p = bernstein[i, k]
            a, b, c = p[1] - p[0], p[2] - p[1], p[3] - p[2]
            most = max(abs(a), abs(c))
            # Only a rate whose middle coefficient is beyond both ends can have its maximum in between.
            if abs(b) > most:
                t = (a - b) / (a - 2.0 * b + c)
                if 0.0 < t < 1.0:
                    most = max(most, abs((1.0 - t) ** 2 * a + 2.0 * t * (1.0 - t) * b + t * t * c))
            rates[i, k] = 3.0 * most / period


@kernel
def cubic_accelerations(bernstein: Floats, period: float, second: Floats) -> None:
    """Fill second (N, d) with the accelerations at the rows between cubics (N − 1, d, 4) in Bernstein form.

    Those from both sides differ by rounding only: the larger is taken.
    """
    last, scale = len(bernstein), 6.0 / period**2
    for k in range(bernstein.shape[1]):
        before = 0.0
        for i in range(last):
            p = bernstein[i, k]
            after = scale * (p[2] - 2.0 * p[1] + p[0])
            second[i, k] = before if i > 0 and abs(before) > abs(after) else after
            before = scale * (p[3] - 2.0 * p[2] + p[1])
        second[last, k] = before
