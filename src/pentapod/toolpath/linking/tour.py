"""Travelling-salesman tour over lines with two ends: nearest neighbours, 2-opt, and a lower bound on its travel.

Nearest neighbour first; then 2-opt (a run of lines turned round) and or-opt (a run of up to three lines put elsewhere)
until neither helps. The bound: travel joins all lines into one, so it is no shorter than the minimum spanning tree of
the lines, where two lines are as far apart as their nearest ends.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

from pentapod.base.arrays import Bools, Floats, Ints

MOST_SWEEPS = 60
_MOST_WORK = 4e8
_MOST_FOR_BOUND = 3000
_GAIN_M = 1e-12


def travel(first: Floats, last: Floats) -> float:
    """Return the travel in metres from the last point of each line to the first (N, 3) of the next."""
    return float(np.linalg.norm(first[1:] - last[:-1], axis=1).sum())


def travel_bound(first: Floats, last: Floats) -> float:
    """Return a length in metres that travel between lines (N, 3), (N, 3) cannot go below, in any order.

    Beyond 3000 lines: half of what separates each line from its nearest, which is cheaper and weaker.
    """
    count = len(first)
    if count < 2:
        return 0.0
    if count > _MOST_FOR_BOUND:
        ends = np.concatenate([first, last])
        near, other = KDTree(ends).query(ends, k=min(8, len(ends)))
        apart = np.where(other % count == (np.arange(2 * count) % count)[:, None], np.inf, near).min(axis=1)
        apart = np.where(np.isfinite(apart), apart, near[:, -1])
        nearest = np.minimum(apart[:count], apart[count:])
        return 0.5 * float(nearest.sum() - np.sort(nearest)[-2:].sum())
    ends = [(first, first), (first, last), (last, first), (last, last)]
    gaps = np.min([cdist(a, b) for a, b in ends], axis=0)
    # A spanning tree takes zeros for missing edges; a hair's breadth more is taken off again.
    tree = minimum_spanning_tree(np.triu(gaps + 1.0, 1))
    return max(0.0, float(tree.sum()) - (count - 1))


def tour(first: Floats, last: Floats, turnable: Bools) -> tuple[Ints, Bools]:
    """Return the order (N,) of lines that begin and end at (N, 3), and which (N,) of them, in it, to run backwards.

    turnable (N,): whether each may run backwards. The tour begins with the first line or with an end of its strip.
    """
    order, backwards = _nearest_neighbour(first, last, turnable)
    heads = np.where(backwards[:, None], last[order], first[order])
    tails = np.where(backwards[:, None], first[order], last[order])
    free = bool(turnable.all())
    for _ in range(MOST_SWEEPS):
        if len(order) < 2 or len(order) ** 2 * MOST_SWEEPS > 100 * _MOST_WORK:
            break
        improved = _two_opt(order, backwards, heads, tails) if free else False
        improved = _or_opt(order, backwards, heads, tails) or improved
        if not improved:
            break
    return order, backwards


def _nearest_neighbour(first: Floats, last: Floats, turnable: Bools) -> tuple[Ints, Bools]:
    count = len(first)
    waiting = np.ones(count, dtype=np.bool_)
    order, backwards = np.zeros(count, dtype=np.intp), np.zeros(count, dtype=np.bool_)
    waiting[0] = False
    here = last[0]
    for k in range(1, count):
        left = np.flatnonzero(waiting)
        to_first = ((first[left] - here) ** 2).sum(axis=1)
        to_last = np.where(turnable[left], ((last[left] - here) ** 2).sum(axis=1), np.inf)
        best = int(np.minimum(to_first, to_last).argmin())
        order[k], backwards[k] = left[best], to_last[best] < to_first[best]
        waiting[left[best]] = False
        here = first[left[best]] if backwards[k] else last[left[best]]
    return order, backwards


def _distance(a: Floats, b: Floats) -> Floats:
    return np.sqrt(((a - b) ** 2).sum(axis=-1))


def _two_opt(order: Ints, backwards: Bools, heads: Floats, tails: Floats) -> bool:
    """Turn runs i to j round while that shortens the travel, in place; return whether one was."""
    count, improved = len(order), False
    for i in range(count):
        j = np.arange(i, count)
        after = np.minimum(j + 1, count - 1)
        leaving = np.where(j < count - 1, _distance(heads[i], heads[after]) - _distance(tails[j], heads[after]), 0.0)
        entering = _distance(tails[i - 1], tails[j]) - _distance(tails[i - 1], heads[i]) if i else 0.0
        gain = leaving + entering
        best = int(gain.argmin())
        if gain[best] < -_GAIN_M:
            run = slice(i, int(j[best]) + 1)
            order[run], backwards[run] = order[run][::-1].copy(), ~backwards[run][::-1]
            heads[run], tails[run] = tails[run][::-1].copy(), heads[run][::-1].copy()
            improved = True
    return improved


def _or_opt(order: Ints, backwards: Bools, heads: Floats, tails: Floats) -> bool:
    """Move runs of one to three lines elsewhere while that shortens the travel, in place; return whether one was."""
    count, improved = len(order), False
    for length in (1, 2, 3):
        for i in range(count - length + 1):
            rest = np.concatenate([np.arange(i), np.arange(i + length, count)])
            if not len(rest):
                continue
            run = np.arange(i, i + length)
            saved = 0.0
            if i:
                saved += float(_distance(tails[i - 1], heads[i]))
            if i + length < count:
                saved += float(_distance(tails[i + length - 1], heads[i + length]))
            if i and i + length < count:
                saved -= float(_distance(tails[i - 1], heads[i + length]))
            # Put before place p of the rest; p = len(rest) is at the end.
            before, behind = tails[rest[:-1]], heads[rest[1:]]
            inner = _distance(before, heads[i]) + _distance(tails[run[-1]], behind) - _distance(before, behind)
            cost = np.concatenate(
                [[_distance(tails[run[-1]], heads[rest[0]])], inner, [_distance(tails[rest[-1]], heads[i])]]
            )
            place = int(cost.argmin())
            if cost[place] < saved - _GAIN_M:
                new = np.concatenate([rest[:place], run, rest[place:]])
                order[:], backwards[:], heads[:], tails[:] = order[new], backwards[new], heads[new], tails[new]
                improved = True
    return improved
