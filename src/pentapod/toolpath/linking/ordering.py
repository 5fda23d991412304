"""Order and direction of passes."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.mesh.passes import Passes
from pentapod.toolpath.linking.tour import tour


@dataclass(frozen=True)
class Turn:
    """One pass in the order of work: its index, whether it is cut backwards, whether it goes on from the last."""

    index: int
    backwards: bool
    near: bool


def by_level(passes: Passes) -> list[Turn]:
    """Return the passes level by level, each as it is; within a level in the direction they are cut."""
    first, last = passes.points[passes.starts[:-1]], passes.points[passes.starts[1:] - 1]
    mean = (last - first).sum(axis=0)
    order = np.lexsort((first @ mean, passes.levels))
    return [Turn(int(k), False, True) for k in order]


def given(passes: Passes) -> list[Turn]:
    """Return the passes in the order they have."""
    return [Turn(k, False, True) for k in range(len(passes))]


def shortest(passes: Passes, both_ways: bool) -> list[Turn]:
    """Return the passes in an order with little travel between them, turned round where that helps."""
    first, last = passes.points[passes.starts[:-1]], passes.points[passes.starts[1:] - 1]
    order, backwards = tour(first, last, np.full(len(passes), both_ways))
    return [Turn(int(k), bool(b), True) for k, b in zip(order, backwards, strict=True)]


def zigzag(passes: Passes, reach: float) -> list[Turn]:
    """Return the passes to and fro: on to the next level while a pass there begins within `reach` metres.

    So the strips on either side of a hole are each finished in one go. The strips follow each other such that
    there is little travel between them. The loop is over passes, not waypoints.
    """
    strips = _strips(passes, reach)
    first, last = passes.points[passes.starts[:-1]], passes.points[passes.starts[1:] - 1]
    heads = np.stack([(last if s[0].backwards else first)[s[0].index] for s in strips])
    tails = np.stack([(first if s[-1].backwards else last)[s[-1].index] for s in strips])
    order, backwards = tour(heads, tails, np.ones(len(strips), dtype=np.bool_))
    turns: list[Turn] = []
    for k, reverse in zip(order, backwards, strict=True):
        strip = [Turn(t.index, not t.backwards, t.near) for t in strips[k][::-1]] if reverse else strips[k]
        turns += [Turn(t.index, t.backwards, place > 0) for place, t in enumerate(strip)]
    return turns


def _strips(passes: Passes, reach: float) -> list[list[Turn]]:
    """Return runs of passes, each near the one before; a run begins in the lowest level that is not done."""
    ends = np.stack([passes.points[passes.starts[:-1]], passes.points[passes.starts[1:] - 1]], axis=1)
    waiting = {int(level): np.flatnonzero(passes.levels == level).tolist() for level in np.unique(passes.levels)}
    lowest = deque(sorted(waiting))
    strips: list[list[Turn]] = []
    here, level = ends[0, 0], lowest[0]
    while lowest:
        following = waiting.get(level + 1, []) if strips else []
        index, backwards, distance = _nearest(ends, following, here)
        near = distance <= reach
        if not near:
            index, backwards, _ = _nearest(ends, waiting[lowest[0]], here)
            strips.append([])
        level = int(passes.levels[index])
        strips[-1].append(Turn(index, backwards, near))
        here = ends[index, 0 if backwards else 1]
        waiting[level].remove(index)
        while lowest and not waiting[lowest[0]]:
            lowest.popleft()
    return strips


def _nearest(ends: Floats, among: list[int], here: Floats) -> tuple[int, bool, float]:
    """Return the pass among some with the end nearest to a point, whether the far end, and the distance."""
    if not among:
        return -1, False, np.inf
    distance = np.linalg.norm(ends[among] - here, axis=2)
    best = int(distance.argmin())
    return int(among[best // 2]), best % 2 == 1, float(distance.flat[best])


def rotated_to_meet(points: Floats, here: Floats | None, closed: Bools | bool) -> int:
    """Return at which point (of n) a closed pass should begin: the one nearest to where the last one ended."""
    if here is None or not closed:
        return 0
    return int(np.linalg.norm(points[:-1] - here, axis=1).argmin())


def aligned(passes: Passes, towards: Floats) -> Passes:
    """Return the passes with closed ones begun where they reach furthest `towards` (3,): neighbours' ends are near."""
    index = np.arange(len(passes.points))
    reach = passes.points @ towards
    for k in np.flatnonzero(passes.closed):
        rows = passes.rows(int(k))
        begin = rows.start + int(reach[rows].argmax())
        around = np.concatenate([np.arange(begin, rows.stop - 1), np.arange(rows.start, begin)])
        index[rows] = np.concatenate([around, around[:1]])
    return Passes(passes.points[index], passes.normals[index], passes.starts, passes.levels)
