"""Sequence and direction of passes: zigzag strips, by level, or the shortest tour."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.mesh.passes import Passes
from pentapod.toolpath.linking.tour import tour
from pentapod.toolpath.strategy import Order


@dataclass(frozen=True)
class OrderedPass:
    """One pass in the order of work: its index, whether it is cut backwards, whether it continues the previous one."""

    index: int
    backwards: bool = False
    near: bool = True


def ordered(passes: Passes, order: Order, both_ways: bool, reach: float) -> list[OrderedPass]:
    """Return the passes in the order of work.

    by-level: in their own direction; within a level in that direction, too. shortest: with little travel, reversed
    where that helps and `both_ways` allows. zigzag: on to the next level while a pass there begins within `reach`
    metres, so the strips on either side of a hole are each finished in one go; strips in an order with little travel.
    """
    first, last = passes.points[passes.starts[:-1]], passes.points[passes.starts[1:] - 1]
    if order is Order.BY_LEVEL:
        mean = (last - first).sum(axis=0)
        return [OrderedPass(int(k)) for k in np.lexsort((first @ mean, passes.levels))]
    if order is Order.SHORTEST:
        sequence, backwards = tour(first, last, both_ways)
        return [OrderedPass(int(k), bool(b)) for k, b in zip(sequence, backwards, strict=True)]
    if order is Order.GIVEN:
        return [OrderedPass(k) for k in range(len(passes))]
    strips = _strips(passes, np.stack([first, last], axis=1), reach)
    heads = np.stack([(last if s[0].backwards else first)[s[0].index] for s in strips])
    tails = np.stack([(first if s[-1].backwards else last)[s[-1].index] for s in strips])
    result: list[OrderedPass] = []
    for k, reverse in zip(*tour(heads, tails, reversible=True), strict=True):
        strip = strips[k][::-1] if reverse else strips[k]
        result += [OrderedPass(p.index, p.backwards != bool(reverse), place > 0) for place, p in enumerate(strip)]
    return result


def _strips(passes: Passes, ends: Floats, reach: float) -> list[list[OrderedPass]]:
    """Return runs of passes with ends (P, 2, 3), each near the one before; a run begins in the lowest waiting level."""
    waiting = {int(level): np.flatnonzero(passes.levels == level).tolist() for level in np.unique(passes.levels)}
    lowest = deque(sorted(waiting))
    strips: list[list[OrderedPass]] = []
    here, level = ends[0, 0], lowest[0]
    while lowest:
        following = waiting.get(level + 1, []) if strips else []
        index, backwards, distance = _nearest(ends, following, here)
        near = distance <= reach
        if not near:
            index, backwards, _ = _nearest(ends, waiting[lowest[0]], here)
            strips.append([])
        level = int(passes.levels[index])
        strips[-1].append(OrderedPass(index, backwards, near))
        here = ends[index, 0 if backwards else 1]
        waiting[level].remove(index)
        while lowest and not waiting[lowest[0]]:
            lowest.popleft()
    return strips


def _nearest(ends: Floats, among: list[int], here: Floats) -> tuple[int, bool, float]:
    """Return the pass among some with the end nearest to a point, whether it is its last, and the distance."""
    if not among:
        return -1, False, np.inf
    distance = np.linalg.norm(ends[among] - here, axis=2)
    best = int(distance.argmin())
    return int(among[best // 2]), best % 2 == 1, float(distance.flat[best])


def aligned(passes: Passes, direction: Floats) -> Passes:
    """Return the passes with closed ones begun at their furthest point along a direction (3,): then ends are near."""
    index = np.arange(len(passes.points))
    along = passes.points @ direction
    for k in np.flatnonzero(passes.closed):
        rows = passes.rows(int(k))
        begin = rows.start + int(along[rows].argmax())
        around = np.concatenate([np.arange(begin, rows.stop - 1), np.arange(rows.start, begin)])
        index[rows] = np.concatenate([around, around[:1]])
    return Passes(passes.points[index], passes.normals[index], passes.starts, passes.levels)
