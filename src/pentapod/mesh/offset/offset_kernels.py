"""Where a level set of the distance from a mesh crosses straight lines, compiled."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.mesh.query.kernels.segment_kernels import STACK, closest
from pentapod.numerics.kernels import kernel

_ROUNDS = 60
_EXACT = 1e-3
"""Of the distance: how near to the level a search on an edge ends. The plane it gives is far nearer."""


@kernel
def cross_level(
    starts: Floats, axes: Ints, lengths: Floats, outward: Bools, level: float, corners: Floats, leaf_starts: Ints,
    extents: Floats, points: Floats, normals: Floats,
) -> None:  # fmt: skip
    """Fill points (E, 3) of planes that touch the level set of the distance where edges cross it, and their normals.

    starts (E, 3), axes (E,), lengths (E,): of the edges, metres, and along which they run. outward (E,): whether the
    distance at the start is above the level; at the other end it is then not, or the other way round. The search ends
    near the level; from there a point is put onto it along the gradient, so that it is beside the edge by no more than
    `_EXACT` of the distance, and off the level by about the square of that.
    Where two facets are as near, no edge depends on the others: none begins with a facet of the one before.
    """
    nodes, bounds, away = np.empty(STACK, dtype=np.intp), np.empty(STACK), np.zeros(6)
    p = np.empty(3)
    for m in range(len(starts)):
        axis, low, high, facet = axes[m], 0.0, lengths[m], -1
        p[:] = starts[m]
        x, distance = 0.0, level
        for number in range(_ROUNDS):
            p[axis] = starts[m, axis] + x
            distance, facet = closest(
                p[0], p[1], p[2], np.inf, facet, corners, leaf_starts, extents, nodes, bounds, away
            )
            here = distance - level
            if abs(here) < _EXACT * level or high - low < _EXACT * level:
                break
            if (here > 0.0) == outward[m]:
                low = x
            else:
                high = x
            # Newton's step, where it stays within the edge; bisection where it does not, and where creases slow it.
            slope = away[axis] / distance
            middle = 0.5 * (low + high)
            step = x - here / slope if slope != 0.0 else middle
            x = step if low < step < high and number % 4 < 3 else middle
        for k in range(3):  # put onto the level, so that few vertices have to be moved there again
            normals[m, k] = away[k] / distance
            points[m, k] = p[k] + (level - distance) * normals[m, k]
