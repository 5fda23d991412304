"""Travelling-salesman tour over lines with two ends: nearest neighbour, 2-opt, or-opt, and a lower bound of its travel.

2-opt reverses a run of lines, or-opt moves a run of up to three lines elsewhere, until neither helps. The bound: travel
joins all lines into one, so it is no shorter than the minimum spanning tree of the lines, where the distance of two
lines is that of their nearest ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

from pentapod.base.arrays import Bools, Floats, Ints


@dataclass(frozen=True)
class TourOptions:
    """Effort of the search.

    sweeps: largest number of improvement sweeps. most_lines: beyond so many lines the order of nearest neighbours is
    kept. gain: smallest improvement, metres. most_for_tree: beyond so many lines the bound needs no spanning tree.
    """

    sweeps: int = 60
    most_lines: int = 25_819
    gain: float = 1e-12
    most_for_tree: int = 3000


def travel(first: Floats, last: Floats) -> float:
    """Return the travel in metres from the last point of each line to the first (N, 3) of the next."""
    return float(np.linalg.norm(first[1:] - last[:-1], axis=1).sum())


def travel_bound(first: Floats, last: Floats, options: TourOptions = TourOptions()) -> float:
    """Return a lower bound in metres of the travel between lines (N, 3), (N, 3) in any order.

    Beyond `most_for_tree` lines: half the distances from each line to its nearest, which is cheaper and weaker.
    """
    count = len(first)
    if count < 2:
        return 0.0
    if count > options.most_for_tree:
        ends = np.concatenate([first, last])
        near, other = KDTree(ends).query(ends, k=min(8, len(ends)))
        distance = np.where(other % count == (np.arange(2 * count) % count)[:, None], np.inf, near).min(axis=1)
        distance = np.where(np.isfinite(distance), distance, near[:, -1])
        nearest = np.minimum(distance[:count], distance[count:])
        return 0.5 * float(nearest.sum() - np.sort(nearest)[-2:].sum())
    ends = [(first, first), (first, last), (last, first), (last, last)]
    gaps = np.min([cdist(a, b) for a, b in ends], axis=0)
    # The spanning tree takes zeros for missing edges: one metre is added to each edge, and subtracted again.
    tree = minimum_spanning_tree(np.triu(gaps + 1.0, 1))
    return max(0.0, float(tree.sum()) - (count - 1))


def tour(first: Floats, last: Floats, reversible: bool, options: TourOptions = TourOptions()) -> tuple[Ints, Bools]:
    """Return the order (N,) of lines that begin and end at (N, 3), and which (N,) of them, in it, run backwards.

    reversible: whether lines may run backwards. The search starts from the first line.
    """
    order, backwards = _nearest_neighbour(first, last, reversible)
    heads = np.where(backwards[:, None], last[order], first[order])
    tails = np.where(backwards[:, None], first[order], last[order])
    for _ in range(options.sweeps):
        if not 2 <= len(order) <= options.most_lines:
            break
        improved = reversible and _two_opt(order, backwards, heads, tails, options.gain)
        improved = _or_opt(order, backwards, heads, tails, options.gain) or improved
        if not improved:
            break
    return order, backwards


def _nearest_neighbour(first: Floats, last: Floats, reversible: bool) -> tuple[Ints, Bools]:
    count = len(first)
    waiting = np.ones(count, dtype=np.bool_)
    order, backwards = np.zeros(count, dtype=np.intp), np.zeros(count, dtype=np.bool_)
    waiting[0] = False
    here = last[0]
    for k in range(1, count):
        left = np.flatnonzero(waiting)
        to_first = ((first[left] - here) ** 2).sum(axis=1)
        to_last = ((last[left] - here) ** 2).sum(axis=1) if reversible else np.full(len(left), np.inf)
        best = int(np.minimum(to_first, to_last).argmin())
        order[k], backwards[k] = left[best], to_last[best] < to_first[best]
        waiting[left[best]] = False
        here = first[left[best]] if backwards[k] else last[left[best]]
    return order, backwards


def _distance(a: Floats, b: Floats) -> Floats:
    return np.sqrt(((a - b) ** 2).sum(axis=-1))


def _two_opt(order: Ints, backwards: Bools, heads: Floats, tails: Floats, gain: float) -> bool:
    """Reverse runs of lines i to j while that shortens the travel, in place; return whether one was reversed."""
    count, improved = len(order), False
    for i in range(count):
        j = np.arange(i, count)
        after = np.minimum(j + 1, count - 1)
        leaving = np.where(j < count - 1, _distance(heads[i], heads[after]) - _distance(tails[j], heads[after]), 0.0)
        entering = _distance(tails[i - 1], tails[j]) - _distance(tails[i - 1], heads[i]) if i else 0.0
        change = leaving + entering
        best = int(change.argmin())
        if change[best] < -gain:
            run = slice(i, int(j[best]) + 1)
            order[run], backwards[run] = order[run][::-1].copy(), ~backwards[run][::-1]
            heads[run], tails[run] = tails[run][::-1].copy(), heads[run][::-1].copy()
            improved = True
    return improved


def _or_opt(order: Ints, backwards: Bools, heads: Floats, tails: Floats, gain: float) -> bool:
    """Move runs of one to three lines elsewhere while that shortens the travel, in place; return whether one moved."""
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
            # Cost of the run in front of each line of the rest, and at the end.
            before, behind = tails[rest[:-1]], heads[rest[1:]]
            inner = _distance(before, heads[i]) + _distance(tails[run[-1]], behind) - _distance(before, behind)
            cost = np.concatenate(
                [[_distance(tails[run[-1]], heads[rest[0]])], inner, [_distance(tails[rest[-1]], heads[i])]]
            )
            place = int(cost.argmin())
            if cost[place] < saved - gain:
                new = np.concatenate([rest[:place], run, rest[place:]])
                order[:], backwards[:], heads[:], tails[:] = order[new], backwards[new], heads[new], tails[new]
                improved = True
    return improved
