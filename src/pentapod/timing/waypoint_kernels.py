"""Compiled kernels of the cubic spline through waypoints: slopes, limit rows, samples along a law.

On stage i, with h = s[i + 1] − s[i] and slopes m at its ends, the spline is the Hermite cubic. Arrays at the waypoints
are (n, d), one column for each coordinate.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import kernel


@kernel
def not_a_knot_slopes(s: Floats, y: Floats, m: Floats, share: Floats) -> None:
    """Fill the slopes m (n, d) of the C2 cubic spline through y (n, d) at rising s (n,), n ≥ 4.

    Inner rows equate the second derivatives of both stages at a waypoint; the first and last row equate the third
    derivatives at the second waypoint and at the last but one ("not a knot"). share (n,): working memory, the upper
    diagonal after elimination; no pivot is near zero, since from the second row on it is above h.
    """
    n, d = y.shape
    h, k = s[1] - s[0], s[2] - s[1]
    share[0] = (h + k) / k
    for j in range(d):
        rise, next_rise = (y[1, j] - y[0, j]) / h, (y[2, j] - y[1, j]) / k
        m[0, j] = ((3.0 * h + 2.0 * k) * k * rise + h * h * next_rise) / ((h + k) * k)
    for i in range(1, n - 1):
        h, k = s[i] - s[i - 1], s[i + 1] - s[i]
        r = 1.0 / (2.0 * (h + k) - k * share[i - 1])
        share[i] = h * r
        before, after = 3.0 * k / h * r, 3.0 * h / k * r
        for j in range(d):
            m[i, j] = before * (y[i, j] - y[i - 1, j]) + after * (y[i + 1, j] - y[i, j]) - k * r * m[i - 1, j]
    h, k = s[n - 2] - s[n - 3], s[n - 1] - s[n - 2]
    r = 1.0 / (h - (h + k) * share[n - 2])
    for j in range(d):
        rise, last_rise = (y[n - 2, j] - y[n - 3, j]) / h, (y[n - 1, j] - y[n - 2, j]) / k
        right = (k * k * rise + (2.0 * h + 3.0 * k) * h * last_rise) / (h + k)
        m[n - 1, j] = (right - (h + k) * m[n - 2, j]) * r
    for i in range(n - 2, -1, -1):
        for j in range(d):
            m[i, j] -= share[i] * m[i + 1, j]


@kernel
def limit_rows(
    s: Floats,
    y: Floats,
    m: Floats,
    velocity: Floats,
    acceleration: Floats,
    first: Floats,
    second: Floats,
    ceiling: Floats,
) -> None:
    """Fill the acceleration rows, first and second (n, d), and the largest x (n,) by velocities.

    velocity and acceleration (d,).
    """
    n, d = y.shape
    for i in range(n):
        a = min(i, n - 2)
        r = 1.0 / (s[a + 1] - s[a])
        fast = 0.0
        for j in range(d):
            rise = (y[a + 1, j] - y[a, j]) * r
            if i == a:
                bend = (6.0 * rise - 4.0 * m[a, j] - 2.0 * m[a + 1, j]) * r
            else:
                bend = (2.0 * m[a, j] + 4.0 * m[a + 1, j] - 6.0 * rise) * r
            first[i, j], second[i, j] = m[i, j] / acceleration[j], bend / acceleration[j]
            fast = max(fast, abs(m[i, j]) / velocity[j])
        ceiling[i] = 1.0 / fast**2 if fast > 0.0 else np.inf


@kernel
def rows_along(s: Floats, y: Floats, m: Floats, times: Floats, speeds: Floats, period: float, rows: Floats) -> None:
    """Fill the spline's rows (count, d) each period, for a law of constant acceleration between waypoints.

    times, speeds (n,): of the law at the waypoints, strictly rising times. The last row is the last waypoint.
    """
    last, d = len(rows) - 1, y.shape[1]
    a = 0
    for k in range(last):
        t = k * period
        while a < len(s) - 2 and times[a + 1] <= t:
            a += 1
        h, lasts = s[a + 1] - s[a], times[a + 1] - times[a]
        u = (t - times[a]) / lasts
        # p: travelled share of the stage's length at the share u of its time.
        p = min(max(u * lasts * (speeds[a] + 0.5 * u * (speeds[a + 1] - speeds[a])) / h, 0.0), 1.0)
        q = 1.0 - p
        for j in range(d):
            rise = y[a + 1, j] - y[a, j]
            rows[k, j] = y[a, j] + p * (rise + q * (q * (h * m[a, j] - rise) - p * (h * m[a + 1, j] - rise)))
    for j in range(d):
        rows[last, j] = y[-1, j]
