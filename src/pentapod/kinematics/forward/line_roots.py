"""The two roots on each solution line: bisection on a concave function, then Newton's method with a bracket.

Loops run over iterations, never over poses; lines that have converged leave the batch.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.kinematics.forward.solution_line import SolutionLine

_EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class RootOptions:
    """How long roots are searched for.

    bisections: at most; fewer halve an interval to neighbouring floats. clearly: a margin below −clearly · l_3 cannot
    come from rounding.
    """

    bisections: int = 64
    clearly: float = 1e-6


OPTIONS = RootOptions()


class Interior(NamedTuple):
    """Where the margin is positive, or else largest: tau (N,), low < tau < high where it is not; exists (N,)."""

    tau: Floats
    low: Floats
    high: Floats
    exists: Bools


def interior(line: SolutionLine, *, thorough: bool = False) -> Interior:
    """Return a point between the two roots of each line (N,); where there is none, the point of largest margin.

    Lemmas 1 and 2 of docs/proofs.md.

    thorough: search for the largest margin also where there clearly are no roots.
    The margin √(D1 E) − |g| is concave, so its slope tells on which side its maximum lies, and its tangent bounds
    what can still be found. A maximum that is negative by no more than rounding counts as a double root: the leg
    lengths of a singular pose, rounded, are those of no pose as often as of two. Near w = 0 the discs D1 ≥ 0 and E ≥ 0
    then have no common point to look at, so such lines are searched once more with both discs larger by rounding.
    """
    tau, low, high = _bracket(line)
    exists = _climb(line, tau, low, high, to_top=False, give_up=True)
    lost = np.flatnonzero(~exists)
    if lost.size:
        loose = line.take(lost).loosened()
        best, low[lost], high[lost] = _bracket(loose)
        exists[lost] = _climb(loose, best, low[lost], high[lost], to_top=True, give_up=not thorough)
        tau[lost] = best
    return Interior(tau, low, high, exists)


def _bracket(line: SolutionLine) -> tuple[Floats, Floats, Floats]:
    """Return the middle (N,) of where both discs hold, and its ends; of the gap where the two intervals are apart."""
    (low1, high1), (low2, high2) = line.directions(), line.positions()
    low, high = np.maximum(low1, low2), np.minimum(high1, high2)
    return 0.5 * (low + high), low, high


def _climb(line: SolutionLine, tau: Floats, low: Floats, high: Floats, *, to_top: bool, give_up: bool) -> Bools:
    """Move tau (N,) between low and high to where the margin is positive, and these nearer; return where it is.

    to_top: to its largest value, also where it is positive already. give_up: stop where none can be positive.
    """
    largest = np.full(len(tau), -np.inf)
    top, active = tau.copy(), np.flatnonzero(low < high)
    for _ in range(OPTIONS.bisections):
        part, at = line.take(active), tau[active]
        margin, slope = part.factors(at).margin()
        better = margin > largest[active]
        largest[active[better]], top[active[better]] = margin[better], at[better]
        running = np.isfinite(margin) & (to_top | ~(margin > 0.0))
        if give_up:
            ahead = np.where(slope > 0.0, high[active] - at, low[active] - at)
            with np.errstate(invalid="ignore"):  # an endless slope, and no way ahead
                running &= ~(margin + slope * ahead < -OPTIONS.clearly * np.sqrt(part.reach_squared))
        rising = slope > 0.0
        low[active] = np.where(running & rising, at, low[active])
        high[active] = np.where(running & ~rising, at, high[active])
        tau[active] = np.where(running, 0.5 * (low[active] + high[active]), at)
        active = active[running & (tau[active] != at)]
        if not active.size:
            break
    tau[:] = top
    return largest > 0.0


def root(line: SolutionLine, outside: Floats, inside: Floats) -> Floats:
    """Return the root of f (N,) between points where f ≤ 0 and points where f > 0, as near as rounding lets it."""
    outside, inside = outside.copy(), inside.copy()
    x = 0.5 * (outside + inside)
    last = np.abs(outside - inside)
    active = np.flatnonzero(np.isfinite(x) & (last > 0.0))
    for _ in range(2 * OPTIONS.bisections):
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
        next_ = np.where(quick, newton, np.where(found, at, 0.5 * (a + b)))
        last[active] = np.abs(next_ - at)
        x[active] = next_
        running = ~found & (last[active] > _EPS * np.abs(next_))
        active = active[running]
        if not active.size:
            break
    return x
