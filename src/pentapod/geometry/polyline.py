"""Polylines: arc length and sampling."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.arrays import Floats, as_floats


def arc_length(points: ArrayLike) -> Floats:
    """Return the cumulated length (N,) along a polyline of points (N, d); starts at 0."""
    p = as_floats(points, "points", (None, None))
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
