"""Local passes of the jerk problem: solved anew about single stations; the rest of the spline stays."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.timing.jerk.problem import LEAD, Problem

_LONGER = 4
"""By how much longer a stretch is tried in which nothing was found."""

_LEAST = 1e-9


def tangents(problem: Problem, y: Floats) -> Floats:
    """Return x (N,) of coefficients at the gridpoints, where the next pass has its tangents."""
    return np.maximum(problem.values(y)[:, 0], _LEAST * problem.top)


def about(problem: Problem, y: Floats, around: Floats, stations: Floats) -> tuple[Floats, Floats]:
    """Return coefficients solved anew about sorted stations (n,), and between which stations (2, k) they are.

    around (N,): tangents to begin with. Where nothing is found the stretch becomes longer, until it is the whole.
    """
    n, lead, changed = len(y), LEAD // 2, [np.zeros((2, 0))]
    while len(stations):
        stretches, last, failed = problem.stretches(stations, lead), np.inf, np.zeros(len(stations), dtype=bool)
        for number in range(problem.options.passes):
            found: list[tuple[int, int]] = []
            for low, high in stretches:
                ends = (problem.held[0] if low == 0 else 3, problem.held[1] if high == n else 3)
                better = problem.solved(y, around, 1, low, high, ends)
                if better is not None:
                    y = better
                    found.append((low, high))
                elif number == 0:
                    failed |= (stations >= problem.knots[low + 3]) & (stations <= problem.knots[high])
            stretches, around = found, tangents(problem, y)
            parts = [problem.gridpoints(low, high) for low, high in stretches]
            taken = sum(float((problem.weight[part] / np.sqrt(around[part])).sum()) for part in parts)
            if number == 0:
                changed.append(np.array([problem.knots[[low, high + 3]] for low, high in found]).reshape(-1, 2).T)
            if last - taken < problem.options.settled * taken or not stretches:
                break
            last = taken
        if lead >= n:
            break
        stations, lead = stations[failed], lead * _LONGER
    return y, np.concatenate(changed, axis=1)
