"""Where a level set of the distance from a mesh crosses straight lines, compiled."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.mesh.query.segment_kernels import STACK, closest
from pentapod.numerics.kernels import kernel

_ROUNDS = 60
_ILLINOIS = 40
_EXACT = 1e-6
"""Of the distance: how near to the level a crossing is."""


@kernel
def cross_level(
    starts: Floats, axes: Ints, lengths: Floats, level: float, corners: Floats, leaf_starts: Ints, extents: Floats,
    points: Floats, normals: Floats,
) -> None:  # fmt: skip
    """Fill where (E, 3) the distance from the mesh is `level` on edges from starts (E, 3), and its gradient there.

    axes (E,): along which the edges run. lengths (E,): of the edges, metres. At one end the distance is above the
    level, at the other not. Regula falsi with the Illinois rule; bisection where that does not end.
    Where two facets are as near, no edge depends on the others: none begins with a facet of the one before.
    """
    nodes, bounds, away = np.empty(STACK, dtype=np.intp), np.empty(STACK), np.zeros(6)
    p = np.empty(3)
    for m in range(len(starts)):
        axis, low, high, side, facet = axes[m], 0.0, lengths[m], 0, -1
        p[:] = starts[m]
        distance, facet = closest(p[0], p[1], p[2], np.inf, facet, corners, leaf_starts, extents, nodes, bounds, away)
        at_low = distance - level
        p[axis] = starts[m, axis] + lengths[m]
        distance, facet = closest(p[0], p[1], p[2], np.inf, facet, corners, leaf_starts, extents, nodes, bounds, away)
        at_high = distance - level
        for number in range(_ROUNDS):
            x = 0.5 * (low + high)
            if number < _ILLINOIS and at_low != at_high:
                x = min(max((at_low * high - at_high * low) / (at_low - at_high), low), high)
            p[axis] = starts[m, axis] + x
            distance, facet = closest(
                p[0], p[1], p[2], np.inf, facet, corners, leaf_starts, extents, nodes, bounds, away
            )
            here = distance - level
            if abs(here) < _EXACT * level or high - low < _EXACT * level:
                break
            if (here > 0.0) == (at_low > 0.0):
                low, at_low = x, here
                at_high = 0.5 * at_high if side == -1 else at_high
                side = -1
            else:
                high, at_high = x, here
                at_low = 0.5 * at_low if side == 1 else at_low
                side = 1
        points[m] = p
        for k in range(3):
            normals[m, k] = away[k] / distance
