"""Constraint tightening: laws limited in jerk are solved again with lower limits where setpoints exceed them.

Between its setpoints the controller makes a spline of its own, which rings where jerks step. Where it exceeds a limit
the rows of the nearest gridpoints get less of that limit; the law changes there and hardly anywhere else.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.timing.jerk.about import about, tangents
from pentapod.timing.jerk.problem import Answer, Problem
from pentapod.timing.jerk.rows import Measure

_JERK, _PUSH = 0.7, 0.9
"""Shares of the limits that a law uses at gridpoints near which setpoints may exceed."""


@dataclass(frozen=True, eq=False)
class Eased:
    """An answer, the seconds that it lasts longer than the one it is made of, and whether setpoints still exceed."""

    answer: Answer
    longer: float
    exceeds: bool


def eased(problem: Problem, y: Floats, measure: Measure) -> Eased:
    """Return an answer whose setpoints keep the limits, as far as that is found."""
    options = problem.options
    lowest = (0.0, options.least_left, options.least_left)
    factors = [np.ones(len(problem.s)) for _ in lowest]
    begun, taken, between = problem, problem.seconds(y), _near_limits(problem, y)
    for attempt in range(options.tightenings):
        over = measure(problem.run(y), between)
        if not len(over.s):
            return Eased((problem, y), problem.seconds(y) - taken, False)
        low = np.maximum(np.searchsorted(problem.s, over.s - over.reach) - 1, 0)
        high = np.minimum(np.searchsorted(problem.s, over.s + over.reach) + 1, len(problem.s))
        extra = 1.0 + (attempt + 1) * options.tighter
        for factor, shares, least in zip(factors, (over.speed, over.acceleration, over.jerk), lowest, strict=True):
            worst = np.ones(len(factor))
            _spread(worst, low, high, np.where(shares > 1.0, shares * extra, 1.0))
            factor[:] = np.maximum(factor / worst, np.minimum(factor, least))
        problem = _with(begun, *factors)
        y, changed = about(problem, y, tangents(problem, y), over.s)
        between = np.concatenate([changed, np.stack([over.s - over.reach, over.s + over.reach])], axis=1)
    return Eased((problem, y), problem.seconds(y) - taken, True)


def _near_limits(problem: Problem, y: Floats) -> Floats:
    """Return stations (2, m) between which a law uses much of its limits."""
    v, rows = problem.values(y), problem.rows
    near = (rows.jerk_uses(v) > _JERK) | (rows.pushes(v) > _PUSH)
    change = np.diff(np.concatenate([[False], near, [False]]).astype(np.int8))
    begin, end = np.flatnonzero(change > 0), np.flatnonzero(change < 0) - 1
    return np.stack([problem.s[np.maximum(begin - 1, 0)], problem.s[np.minimum(end + 1, len(problem.s) - 1)]])


def _spread(worst: Floats, low: Ints, high: Ints, shares: Floats) -> None:
    """Raise `worst` (N,) to the shares (n,) from gridpoints low to before high (n,)."""
    for k in range(int((high - low).max())):
        here = low + k < high
        np.maximum.at(worst, low[here] + k, shares[here])


def _with(problem: Problem, speed: Floats, acceleration: Floats, jerk: Floats) -> Problem:
    """Return the problem with less of its limits: by factors (N,)."""
    rows = problem.rows
    softer = replace(
        rows,
        first=rows.first / acceleration[:, None],
        second=rows.second / acceleration[:, None],
        jerks=rows.jerks / jerk[:, None, None],
        ceiling=rows.ceiling * speed**2,
    )
    return replace(problem, rows=softer, top=problem.top * speed**2)
