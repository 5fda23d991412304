"""Polylines: arc length and sampling."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats, row_lengths
from pentapod.geometry.runs import members


def arc_length(points: ArrayLike) -> Floats:
    """Return the cumulated length (N,) along a polyline of points (N, d); starts at 0."""
    p = as_floats(points, "points", (None, None))
    return np.concatenate([[0.0], np.cumsum(row_lengths(np.diff(p, axis=0)))])


def spaced(corners: Floats, spacing: float) -> Floats:
    """Return the polyline (M, 3) with points added so that neighbours are at most `spacing` metres apart."""
    steps = row_lengths(np.diff(corners, axis=0))
    counts = np.maximum(np.ceil(steps / spacing - 1e-9), 1.0).astype(np.intp)
    side, number = members(counts)
    t = (number / counts[side])[:, None]
    return np.vstack([corners[side] + t * (corners[side + 1] - corners[side]), corners[-1:]])
