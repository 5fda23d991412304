"""The two passes of TOPP-RA as plain loops, compiled: the controllable speeds backwards, the fastest forwards.

In every stage x = ṡ² is linear in s with slope 2u, and each row holds at both of its ends:
|a u + b x − c| ≤ 1. For one x the rows leave an interval of u; its lower end is convex in x and its upper end
concave, so the largest x with an interval is the right root of a convex, piecewise linear function, which
Newton's method finds from the right in a few steps. (Pham and Pham 2018, solved without linear programs.)

All thresholds are relative: the kernels work in any units. a, b (n, rows); c (n, rows) where `varies` is 1,
(1, rows) where it is 0.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.kernels import kernel

CLOSED_GAP = 1e-13
"""A gap between the ends of an interval counts as closed below this share of them."""

NEGLIGIBLE_TERM = 1e-13
"""A row whose u-term can reach no more than this share of its limit bounds x alone."""

NEWTON_STEPS = 100
"""Largest number of Newton steps of a stage."""


@kernel
def _fits(a: Floats, b: Floats, c: Floats, varies: int, i: int, u: float, here: float, there: float) -> bool:
    """Return whether the rows of stage i allow u from x = here to x = there."""
    fits = True
    for j in range(a.shape[1]):
        fits &= abs(a[i, j] * u + b[i, j] * here - c[i * varies, j]) <= 1.0
        fits &= abs(a[i + 1, j] * u + b[i + 1, j] * there - c[(i + 1) * varies, j]) <= 1.0
    return fits


@kernel
def _reach(a: Floats, b: Floats, c: Floats, varies: int, i: int, twice: float, there: float) -> float:
    """Return an upper bound of x at stage i, of the row steepest in x, for 0 ≤ x ≤ there at its end."""
    steepest, reach = 0.0, np.inf
    for j in range(a.shape[1]):
        tilt = abs(b[i, j] - a[i, j] / twice)
        if tilt > steepest:
            steepest = tilt
            reach = (1.0 + abs(c[i * varies, j]) + abs(a[i, j]) / twice * there) / tilt
        tilt = abs(a[i + 1, j]) / twice
        if tilt > steepest:
            steepest = tilt
            side = abs(a[i + 1, j] / twice + b[i + 1, j]) * there
            reach = (1.0 + abs(c[(i + 1) * varies, j]) + side) / tilt
    return 1.01 * reach


@kernel
def _row(
    a: Floats, b: Floats, c: Floats, varies: int, i: int, j: int, end: int, twice: float
) -> tuple[float, float, float]:
    """Return f ≥ 0, g, c of row j at the start (end 0) or end (1) of stage i: |f u + g x − c| ≤ 1, x at its start."""
    g = b[i + end, j]
    f = a[i + end, j] + end * twice * g
    shift = c[(i + end) * varies, j]
    return (-f, -g, -shift) if f < 0.0 else (f, g, shift)


@kernel
def _stage(
    a: Floats,
    b: Floats,
    c: Floats,
    varies: int,
    i: int,
    twice: float,
    x: float,
    there: float,
    rows: Floats,
    names: Ints,
) -> tuple[int, float]:
    """Write a stage's rows as rows[0] − rows[2] x ≤ u ≤ rows[1] − rows[2] x, from the second on.

    names: 2j for row j at the stage's start, 2j + 1 at its end. Returns how many there are, and x within the bounds of
    the rows in which u plays no part.
    """
    least = NEGLIGIBLE_TERM * twice / max(x, there, 1e-300)
    m = 1
    for j in range(a.shape[1]):
        for end in range(2):
            f, g, shift = _row(a, b, c, varies, i, j, end, twice)
            if f > least:
                r = 1.0 / f
                rows[0, m], rows[1, m], rows[2, m], names[m] = (shift - 1.0) * r, (shift + 1.0) * r, g * r, 2 * j + end
                m += 1
            elif g != 0.0:
                x = min(x, (1.0 + (shift if g > 0.0 else -shift)) / abs(g))
    return m, x


@kernel
def _interval(x: float, rows: Floats, m: int) -> tuple[float, float, int, int]:
    """Return the interval of u that m rows leave at x, and the rows that bound it below and above."""
    low, high, below, above = -np.inf, np.inf, 0, 0
    for j in range(m):
        t = rows[2, j] * x
        if rows[0, j] - t > low:
            low, below = rows[0, j] - t, j
        if rows[1, j] - t < high:
            high, above = rows[1, j] - t, j
    return low, high, below, above


@kernel
def _right_root(x: float, rows: Floats, m: int) -> tuple[float, int, int]:
    """Return the largest x up to the given one that leaves an interval, −1 if none does, and the last two rows."""
    cap, below, above = x, 0, 0
    for attempt in range(NEWTON_STEPS):
        least, most, below, above = _interval(x, rows, m)
        gap = least - most
        close = CLOSED_GAP * (abs(least) + abs(most))
        if gap <= close and (attempt == 0 or gap >= -close):
            return x, below, above
        slope = rows[2, above] - rows[2, below]
        if slope <= 0.0:
            return (-1.0 if gap > 0.0 else x), below, above
        new = min(x - gap / slope, cap)
        if new < 0.0:
            least, most, below, above = _interval(0.0, rows, m)
            return (0.0 if least - most <= CLOSED_GAP * (abs(least) + abs(most)) else -1.0), below, above
        if new == x:
            return x, below, above
        x = new
    return x, below, above


@kernel
def _left_root(top: float, rows: Floats, m: int) -> tuple[float, int, int]:
    """Return the least x up to `top` that leaves an interval, −1 if none does, and the last two rows."""
    x, below, above = 0.0, 0, 0
    for _ in range(NEWTON_STEPS):
        least, most, below, above = _interval(x, rows, m)
        gap = least - most
        if gap <= CLOSED_GAP * (abs(least) + abs(most)):
            break
        slope = rows[2, above] - rows[2, below]
        new = x - gap / slope if slope < 0.0 else np.inf
        if not new <= top * (1.0 + 1e-12):
            return -1.0, below, above
        if new == x:
            break
        x = new
    return min(x, top), below, above


@kernel
def controllable(
    s: Floats, a: Floats, b: Floats, c: Floats, varies: int, ceiling: Floats, low: Floats, high: Floats, conflict: Ints
) -> int:
    """Fill the least and largest controllable x, low and high (n,), backwards from their last entries.

    Returns −1, or the gridpoint from which no law goes on; conflict (2,) then names the two rows that leave no u: 2j
    for row j at the stage's start, 2j + 1 at its end, −1 for the reach of the next gridpoint's speeds; −2 twice
    where nothing bounds x.
    """
    rows, names = np.empty((3, 2 * a.shape[1] + 1)), np.empty(2 * a.shape[1] + 1, np.int64)
    names[0] = -1
    for i in range(len(s) - 2, -1, -1):
        twice = 2.0 * (s[i + 1] - s[i])
        x, there = ceiling[i], high[i + 1]
        if twice == 0.0:  # the coefficients jump: the speed is the same on both sides
            high[i], low[i] = min(x, there), low[i + 1]
            if high[i] < low[i]:
                conflict[:] = -1
                return i
            continue
        # Most gridpoints run at their ceiling: the stage to the next one's largest x is then allowed at once.
        if low[i + 1] == 0.0 and np.isfinite(x) and _fits(a, b, c, varies, i, (there - x) / twice, x, there):
            low[i], high[i] = 0.0, x
            continue
        if not x <= 1e3 * there:  # far above what can be reached, Newton would lose digits
            x = min(x, _reach(a, b, c, varies, i, twice, there))
            if not np.isfinite(x):
                conflict[:] = -2
                return i
        rows[0, 0], rows[1, 0], rows[2, 0] = low[i + 1] / twice, there / twice, 1.0 / twice
        m, x = _stage(a, b, c, varies, i, twice, x, there, rows, names)
        x, below, above = _right_root(x, rows, m)
        least = 0.0
        if x >= 0.0 and low[i + 1] > 0.0:
            least, below, above = _left_root(x, rows, m)
        if x < 0.0 or least < 0.0:
            conflict[0], conflict[1] = names[below], names[above]
            return i
        low[i], high[i] = least, x
    return -1


@kernel
def fastest_forward(
    s: Floats, a: Floats, b: Floats, c: Floats, varies: int, low: Floats, high: Floats, x: Floats
) -> None:
    """Fill the largest reachable x (n,) forwards from its first entry, within the controllable speeds."""
    for i in range(len(s) - 1):
        twice = 2.0 * (s[i + 1] - s[i])
        here, top = x[i], high[i + 1]
        u = (top - here) / twice
        if twice == 0.0:
            x[i + 1] = min(here, top)
            continue
        if _fits(a, b, c, varies, i, u, here, top):
            x[i + 1] = top
            continue
        least = NEGLIGIBLE_TERM * twice / max(here, top, 1e-300)
        for j in range(a.shape[1]):
            for end in range(2):
                f, g, shift = _row(a, b, c, varies, i, j, end, twice)
                if f > least:
                    u = min(u, (shift + 1.0 - g * here) / f)
        x[i + 1] = min(max(here + twice * u, low[i + 1]), top)
