"""Ordering: which pass follows which, and which way it is cut."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from pentapod.arrays import Floats
from pentapod.toolpath.passes import Passes


@dataclass(frozen=True)
class Turn:
    """One pass in the order of work: its index, whether it is cut backwards, whether it is near the last."""

    index: int
    backwards: bool
    near: bool


def one_way(passes: Passes, direction: Floats) -> list[Turn]:
    """Return the passes plane by plane, each cut along `direction` (3,), first things first."""
    along = passes.points[passes.starts[:-1]] @ direction
    order = np.lexsort((along, passes.planes))
    return [Turn(int(k), False, False) for k in order]


def zigzag(passes: Passes, reach: float) -> list[Turn]:
    """Return the passes to and fro: on to the next plane while a pass there begins within `reach` metres.

    Where none does, work goes on at the nearest end of a pass in the lowest plane that is not done. So the
    strips on either side of a hole are each finished in one go. The loop is over passes, not waypoints.
    """
    ends = np.stack([passes.points[passes.starts[:-1]], passes.points[passes.starts[1:] - 1]], axis=1)
    waiting = {int(plane): np.flatnonzero(passes.planes == plane).tolist() for plane in np.unique(passes.planes)}
    lowest = deque(sorted(waiting))
    turns: list[Turn] = []
    here = ends[0, 0] if len(ends) else np.zeros(3)
    plane = lowest[0] if lowest else 0
    while lowest:
        index, backwards, distance = _nearest(ends, waiting.get(plane + 1, []), here) if turns else (-1, False, np.inf)
        near = distance <= reach
        if not near:
            index, backwards, _ = _nearest(ends, waiting[lowest[0]], here)
        plane = int(passes.planes[index])
        turns.append(Turn(index, backwards, near))
        here = ends[index, 0 if backwards else 1]
        waiting[plane].remove(index)
        while lowest and not waiting[lowest[0]]:
            lowest.popleft()
    return turns


def _nearest(ends: Floats, among: list[int], here: Floats) -> tuple[int, bool, float]:
    """Return the pass among some with the end nearest to a point, whether the far end, and the distance."""
    if not among:
        return -1, False, np.inf
    distance = np.linalg.norm(ends[among] - here, axis=2)
    best = int(distance.argmin())
    return int(among[best // 2]), best % 2 == 1, float(distance.flat[best])
