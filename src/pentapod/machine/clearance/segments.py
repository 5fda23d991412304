"""Distances between line segments, batched: the one formula under all clearances."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_batch

_TINY = 1e-30  # m²: keeps a division by the length of a degenerate segment finite


def segment_distance(start_a: ArrayLike, end_a: ArrayLike, start_b: ArrayLike, end_b: ArrayLike) -> Floats:
    """Return the distances (...,) in metres between segments a and b, ends (..., 3), broadcast.

    Degenerate (one point) and parallel segments are allowed. Source: C. Ericson, Real-Time Collision
    Detection, section 5.1.9. Minimising over one segment's parameter, then the other's, then the first's
    again is exact for this convex problem, since the first guess is exact wherever no end is hit.
    """
    a0, a1 = as_batch(start_a, "start_a", (3,)), as_batch(end_a, "end_a", (3,))
    b0, b1 = as_batch(start_b, "start_b", (3,)), as_batch(end_b, "end_b", (3,))
    along_a, along_b, between = a1 - a0, b1 - b0, a0 - b0
    aa = np.maximum(_dot(along_a, along_a), _TINY)
    bb = np.maximum(_dot(along_b, along_b), _TINY)
    ab, a_gap, b_gap = _dot(along_a, along_b), _dot(along_a, between), _dot(along_b, between)
    parallel = np.maximum(aa * bb - ab * ab, _TINY * aa * bb + _TINY * _TINY)
    s = np.clip((ab * b_gap - a_gap * bb) / parallel, 0.0, 1.0)
    t = np.clip((ab * s + b_gap) / bb, 0.0, 1.0)
    s = np.clip((ab * t - a_gap) / aa, 0.0, 1.0)
    gap = between + s[..., None] * along_a - t[..., None] * along_b
    return np.sqrt(_dot(gap, gap))


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("...i,...i->...", a, b)
