"""What a cubic controller makes of setpoints: the exact extrema of rates and accelerations between rows."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_banded

from pentapod.arrays import Floats


def cubic_extrema(values: Floats, period: float) -> tuple[Floats, Floats]:
    """Return the largest |rate| (n - 1, d) in each interval and |acceleration| (n, d) at each row.

    values (n, d): rows at equal periods, joined by the C2 cubic spline with zero end velocities. Its
    acceleration is linear between rows, hence largest at rows; its rate is quadratic, hence largest at
    rows or where the acceleration crosses zero.
    """
    steps = np.diff(values, axis=0) / period
    bands = np.ones((3, len(values)))
    bands[1] = 4.0
    bands[1, [0, -1]] = 2.0
    right = np.diff(steps, axis=0, prepend=np.zeros_like(steps[:1]), append=np.zeros_like(steps[:1]))
    m = solve_banded((1, 1), bands, 6.0 / period * right, check_finite=False)
    left, after = m[:-1], m[1:]
    rates = np.maximum(
        np.abs(steps - period * (2.0 * left + after) / 6.0),
        np.abs(steps + period * (left + 2.0 * after) / 6.0),
    )
    crossing = left * after < 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.abs(steps - period * (2.0 * left + after) / 6.0 - period * left**2 / (2.0 * (after - left)))
    return np.where(crossing, np.maximum(rates, turn), rates), np.abs(m)
