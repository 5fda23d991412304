"""Contour error: how far a tool is from the path it should be on, whenever it gets there."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.directions import angle_between


def contour_errors(
    tips: Floats, directions: Floats, path: Floats, path_directions: Floats, due: Ints, window: int
) -> tuple[Floats, Floats]:
    """Return distances (N,), metres, from tips (N, 3) to a path (M, 3), and angles (N,), radians, to its directions.

    A tip is compared with the chords of the path at most `window` before or behind the waypoint due (N,) at its time:
    a neighbouring pass that happens to be near does not count. The directions (M, 3) are compared at the nearest place.
    """
    last = len(path) - 2
    best, at = np.full(len(tips), np.inf), np.zeros(len(tips))
    for shift in sorted(range(-window, window), key=abs, reverse=True):
        k = np.clip(due + shift, 0, last)
        step, away = path[k + 1] - path[k], tips - path[k]
        square = np.einsum("ij,ij->i", step, step)
        along = np.clip(np.einsum("ij,ij->i", step, away) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
        away -= along[:, None] * step
        distance = np.einsum("ij,ij->i", away, away)
        # Of equally near places (the tool stands) the one that is due counts: it comes last.
        nearer = distance <= best
        best, at = np.where(nearer, distance, best), np.where(nearer, k + along, at)
    k = np.minimum(at.astype(np.intp), last)
    f = (at - k)[:, None]
    wanted = (1.0 - f) * path_directions[k] + f * path_directions[k + 1]
    return np.sqrt(best), angle_between(directions, wanted)
