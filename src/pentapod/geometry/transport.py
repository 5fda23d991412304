"""Rotation-minimising frames along a sequence of directions (parallel transport)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats
from pentapod.geometry.directions import tangent_frame


def carried_frames(directions: ArrayLike) -> Floats:
    """Return unit pairs (N, 2, 3) across unit directions (N, 3), each carried from the one before.

    The smallest rotation that takes a direction to the next takes its pair along (parallel transport on the sphere; a
    rotation-minimising frame: Bishop 1975). So the pairs turn as little as the directions let them, through the equator
    and the poles too. The angle between any other frames and the carried ones is a sum along the
    sequence, so there is no loop. Between opposite directions the way is not defined; any is taken.
    """
    d = as_floats(directions, "directions", (3,))
    t1, t2 = tangent_frame(d)
    here, there = d[:-1], d[1:]
    along = (t1[:-1] * there).sum(axis=1) / np.maximum(1.0 + (here * there).sum(axis=1), 1e-12)
    taken = t1[:-1] - along[:, None] * (here + there)
    turn = np.arctan2((taken * t2[1:]).sum(axis=1), (taken * t1[1:]).sum(axis=1))
    angle = np.concatenate([[0.0], np.cumsum(turn)])[:, None]
    return np.stack([np.cos(angle) * t1 + np.sin(angle) * t2, np.cos(angle) * t2 - np.sin(angle) * t1], axis=1)
