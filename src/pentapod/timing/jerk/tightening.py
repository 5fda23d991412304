"""Constraint tightening: jerk-limited laws are solved again with lower limits where setpoints exceed them.

Between its setpoints the controller makes a spline of its own, which overshoots where jerks step. Where it exceeds a
limit, that limit is lowered in the rows of the nearest gridpoints; the law changes little elsewhere.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.timing.jerk.passes import solve_locally
from pentapod.timing.jerk.rows import MeasureExcess
from pentapod.timing.jerk.subproblem import Answer, Subproblem


def tightened(problem: Subproblem, y: Floats, measure: MeasureExcess) -> tuple[Answer, float, bool]:
    """Return an answer whose setpoints keep the limits, as far as one is found.

    Also the seconds by which it lasts longer than before, and whether setpoints still exceed limits.
    """
    options, given = problem.options.tightening, problem
    lowest = (0.0, options.least_left, options.least_left)
    factors = [np.ones(len(problem.s)) for _ in lowest]
    seconds, between = problem.seconds(y), _near_limits(problem, y)
    for attempt in range(options.rounds):
        over = measure(problem.nodes(y), between)
        if not len(over.s):
            return (problem, y), problem.seconds(y) - seconds, False
        low = np.maximum(np.searchsorted(problem.s, over.s - over.reach) - 1, 0)
        high = np.minimum(np.searchsorted(problem.s, over.s + over.reach) + 1, len(problem.s))
        extra = 1.0 + (attempt + 1) * options.extra
        for factor, shares, least in zip(factors, (over.speed, over.acceleration, over.jerk), lowest, strict=True):
            worst, lowered = np.ones(len(factor)), np.where(shares > 1.0, shares * extra, 1.0)
            for k in range(int((high - low).max())):
                here = low + k < high
                np.maximum.at(worst, low[here] + k, lowered[here])
            factor[:] = np.maximum(factor / worst, np.minimum(factor, least))
        problem = _with_limits(given, *factors)
        y, changed = solve_locally(problem, y, problem.tangent_points(y), over.s)
        between = np.concatenate([changed, np.stack([over.s - over.reach, over.s + over.reach])], axis=1)
    return (problem, y), problem.seconds(y) - seconds, True


def _near_limits(problem: Subproblem, y: Floats) -> Floats:
    """Return stations (2, m) between which a law is near its limits."""
    v, rows, options = problem.values(y), problem.rows, problem.options.tightening
    near = (rows.jerk_shares(v) > options.jerk_share) | (rows.acceleration_shares(v) > options.acceleration_share)
    change = np.diff(np.concatenate([[False], near, [False]]).astype(np.int8))
    begin, end = np.flatnonzero(change > 0), np.flatnonzero(change < 0) - 1
    return np.stack([problem.s[np.maximum(begin - 1, 0)], problem.s[np.minimum(end + 1, len(problem.s) - 1)]])


def _with_limits(problem: Subproblem, speed: Floats, acceleration: Floats, jerk: Floats) -> Subproblem:
    """Return the problem with its limits multiplied by factors (N,)."""
    rows = problem.rows
    softer = replace(
        rows,
        first=rows.first / acceleration[:, None],
        second=rows.second / acceleration[:, None],
        jerks=rows.jerks / jerk[:, None, None],
        ceiling=rows.ceiling * speed**2,
    )
    return replace(problem, rows=softer, top=problem.top * speed**2)
