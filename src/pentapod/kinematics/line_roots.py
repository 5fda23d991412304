"""The two roots on each solution line: found by bisection on a concave function, then by bracketed Newton.

Loops run over iterations, never over poses; what has converged leaves the batch.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pentapod.arrays import Bools, Floats
from pentapod.kinematics.solution_line import SolutionLine

_EPS = float(np.finfo(np.float64).eps)
_ROUNDS = 64  # bisection halves an interval to neighbouring floats in fewer
_CLEARLY = 1e-6  # a margin of −_CLEARLY · l_3 is no work of rounding


class Interior(NamedTuple):
    """Where the margin is positive, or else largest: tau (N,), low < tau < high where it is not; exists (N,)."""

    tau: Floats
    low: Floats
    high: Floats
    exists: Bools


def interior(line: SolutionLine, *, thorough: bool = False) -> Interior:
    """Return a point between the two roots of each line (N,); where none exists, the best there is.

    thorough: where none exists, go on to the best point instead of stopping when that is known.
    The margin √(D1 E) − |g| is concave, so its slope tells on which side its maximum lies, and its tangent bounds
    what can still be found. A maximum that is negative by no more than rounding counts as a double root:
    the leg lengths of a singular pose, rounded, are those of no pose as often as of two.
    """
    (low1, high1), (low2, high2) = line.directions(), line.positions()
    low, high = np.maximum(low1, low2), np.minimum(high1, high2)
    tau = 0.5 * (low + high)  # the middle of the gap where the intervals are apart: nothing to search there
    active = np.flatnonzero(low < high)
    for _ in range(_ROUNDS):
        part = line.take(active)
        margin, slope = part.factors(tau[active]).margin()
        running = ~(margin > 0.0)
        if not thorough:
            ahead = np.where(slope > 0.0, high[active] - tau[active], low[active] - tau[active])
            running &= margin + slope * ahead >= -_CLEARLY * np.sqrt(part.reach_squared)
        active, rising = active[running], slope[running] > 0.0
        if not active.size:
            break
        low[active] = np.where(rising, tau[active], low[active])
        high[active] = np.where(rising, high[active], tau[active])
        tau[active] = 0.5 * (low[active] + high[active])
    return Interior(tau, low, high, _holds(line, tau))


def _holds(line: SolutionLine, tau: Floats) -> Bools:
    """Return whether D1, E and f are ≥ 0 at tau (N,), rounding forgiven."""
    values = line.factors(tau)
    in_d1, in_e, in_f = line.doubt(tau)
    return (values.d1 >= -in_d1) & (values.e >= -in_e) & (values.f()[0] >= -in_f)


def root(line: SolutionLine, outside: Floats, inside: Floats) -> Floats:
    """Return the root of f (N,) between points where f ≤ 0 and points where f > 0, as near as rounding lets it."""
    outside, inside = outside.copy(), inside.copy()
    x = 0.5 * (outside + inside)
    last = np.abs(outside - inside)
    active = np.flatnonzero(np.isfinite(x) & (last > 0.0))
    for _ in range(2 * _ROUNDS):
        part, at = line.take(active), x[active]
        values = part.factors(at)
        f, slope = values.f()
        positive = f > 0.0
        inside[active] = np.where(positive, at, inside[active])
        outside[active] = np.where(positive, outside[active], at)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = at - f / slope
        a, b = outside[active], inside[active]
        within = (np.minimum(a, b) <= newton) & (newton <= np.maximum(a, b))
        found = np.abs(f) <= _EPS * (values.e + values.d1 * part.reach_squared + np.square(values.g))
        quick = within & (found | (2.0 * np.abs(f) < np.abs(last[active] * slope)))
        following = np.where(quick, newton, np.where(found, at, 0.5 * (a + b)))
        last[active] = np.abs(following - at)
        x[active] = following
        running = ~found & (last[active] > _EPS * np.abs(following))
        active = active[running]
        if not active.size:
            break
    return x
