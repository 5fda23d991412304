"""Uphill and downhill passes: split where they turn from rising to falling, and turned to run one way."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.mesh.passes import Passes


def monotone(passes: Passes, view: Floats, *, upwards: bool, least: float) -> Passes:
    """Return passes that only rise along view (3,), or only fall: split at ridges and valleys, turned where needed.

    What rises or falls by less than `least` metres on the way is taken for noise of the mesh.
    """
    height = passes.points @ view
    pieces: list[tuple[Floats, Floats]] = []
    levels: list[int] = []
    for k, level in enumerate(passes.levels):
        rows = passes.rows(k)
        points, normals = passes.points[rows], passes.normals[rows]
        cuts = _turning_points(height[rows], least)
        for a, b in pairwise(cuts):
            run = slice(a, b + 1)
            rises = height[rows][b] >= height[rows][a]
            order = slice(None, None, 1 if rises == upwards else -1)
            pieces.append((points[run][order], normals[run][order]))
            levels.append(int(level))
    return Passes.of(pieces, np.array(levels, dtype=np.intp))


def _turning_points(height: Floats, least: float) -> list[int]:
    """Return the indices of the ends and of the highest and lowest points between which height (n,) changes by more."""
    rise = np.sign(np.diff(height))
    local: Ints = np.flatnonzero(rise[1:] != rise[:-1]) + 1
    found, sense = [0], 0
    for k in [*local.tolist(), len(height) - 1]:
        change = height[k] - height[found[-1]]
        if sense and change * sense >= 0.0:
            found[-1] = k  # further the same way
        elif abs(change) > least:
            found.append(k)
            sense = 1 if change > 0.0 else -1
    # The first point may be a little inside a run that begins before it.
    found[0] = 0
    if found[-1] != len(height) - 1:
        if len(found) > 1:
            found[-1] = len(height) - 1
        else:
            found.append(len(height) - 1)
    return found
