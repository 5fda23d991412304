"""Waypoints that shape a path: those between which it is straight, within a share of its tolerance, are left out."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.numerics.kernels import kernel


@kernel
def mark_shaping(u: Floats, points: Floats, tolerances: Floats, keep: Bools) -> None:
    """Mark further points (N,) to keep, beside those that are: the ends must be.

    Every point left out is within its tolerances (N, D) of the chord between the kept ones around it, at its parameter
    u (N,); points (N, D). From each kept point on, the slopes of chords that pass all points so far are an interval for
    each coordinate; the last point whose chord has such a slope is kept.
    """
    columns, last = points.shape[1], 0
    low, high = np.full(columns, -np.inf), np.full(columns, np.inf)
    for j in range(1, len(u)):
        passes = True
        for c in range(columns):
            slope = (points[j, c] - points[last, c]) / (u[j] - u[last])
            passes = passes and low[c] <= slope <= high[c]
        if not passes:
            last = j - 1
            keep[last] = True
            low[:], high[:] = -np.inf, np.inf
        if keep[j]:
            last = j
            low[:], high[:] = -np.inf, np.inf
            continue
        for c in range(columns):
            step = points[j, c] - points[last, c]
            low[c] = max(low[c], (step - tolerances[j, c]) / (u[j] - u[last]))
            high[c] = min(high[c], (step + tolerances[j, c]) / (u[j] - u[last]))
