"""Where a level set of the distance from a mesh crosses straight lines, compiled.

The distance from one facet is convex along a line: between a place where it is above the level and one where it is not
it crosses the level once, and Newton's steps from above lead there without going past. The distance from the mesh is
that from its nearest facet: where another one is nearer at such a crossing, its own crossing lies between the place
above and there.
"""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.mesh.query.ball_kernels import facet_distance
from pentapod.mesh.query.segment_kernels import STACK, closest
from pentapod.numerics.kernels import kernel

_ROUNDS = 60
_EXACT = 1e-6
"""Of the distance: how near to the level a crossing is."""


@kernel
def _crossing(facet: Floats, p: Floats, axis: int, low: float, high: float, level: float, g: Floats) -> float:
    """Return where between low and high along an axis the distance of p (3,) from a facet is `level`, p moved there.

    At high it is above the level, at low it is not; high may be below low. g (3,): room.
    """
    x = high
    for _ in range(_ROUNDS):
        p[axis] = x
        distance = facet_distance(facet, p[0], p[1], p[2], g)
        over = distance - level
        if over < 0.1 * _EXACT * level:
            break
        x -= over * distance / g[axis]
        if not min(low, high) <= x <= max(low, high):  # rounding errors alone lead there
            x = low
    p[axis] = x
    return x


@kernel
def cross_level(
    starts: Floats, axes: Ints, lengths: Floats, outward: Bools, level: float, corners: Floats, leaf_starts: Ints,
    extents: Floats, points: Floats, normals: Floats,
) -> None:  # fmt: skip
    """Fill where (E, 3) the distance from the mesh is `level` on edges from starts (E, 3), and its gradient there.

    axes (E,): along which the edges run. lengths (E,): of the edges, metres. outward (E,): whether the distance is
    above the level at the start and not at the other end, or the other way round.
    Where two facets are as near, no edge depends on the others: none begins with a facet of the one before.
    """
    nodes, bounds, away = np.empty(STACK, dtype=np.intp), np.empty(STACK), np.zeros(6)
    p, g = np.empty(3), np.empty(3)
    for m in range(len(starts)):
        axis = axes[m]
        p[:] = starts[m]
        high = p[axis] if outward[m] else p[axis] + lengths[m]
        low = p[axis] + lengths[m] if outward[m] else p[axis]
        p[axis] = low
        distance, facet = closest(p[0], p[1], p[2], math.inf, -1, corners, leaf_starts, extents, nodes, bounds, away)
        for _ in range(_ROUNDS):
            if abs(distance - level) < _EXACT * level:
                break
            low = _crossing(corners[facet], p, axis, low, high, level, g)
            distance, facet = closest(
                p[0], p[1], p[2], math.inf, facet, corners, leaf_starts, extents, nodes, bounds, away
            )
        points[m] = p
        for k in range(3):
            normals[m, k] = away[k] / distance
