"""The leg lengths, compiled: the operations of `FiveLegs.leg_lengths` in the same order, equal to the last bit."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import kernel

_LANES = 64  # poses at a time: their columns become vector instructions


@kernel
def lengths(position: Floats, direction: Floats, base: Floats, offsets: Floats, legs: Floats) -> None:
    """Fill legs (N, 5) for position and direction (N, 3), base (5, 2) and offsets (5,)."""
    count = len(position)
    pose, found = np.empty((6, _LANES)), np.empty((5, _LANES))
    pose[:] = 0.0
    for start in range(0, count, _LANES):
        lanes = min(_LANES, count - start)
        for k in range(lanes):
            for j in range(3):
                pose[j, k] = position[start + k, j]
                pose[3 + j, k] = direction[start + k, j]
        for leg in range(5):
            x, y, z = base[leg, 0], base[leg, 1], offsets[leg]
            for k in range(_LANES):
                dx = z * pose[3, k] + (pose[0, k] - x)
                dy = z * pose[4, k] + (pose[1, k] - y)
                dz = z * pose[5, k] + pose[2, k]
                found[leg, k] = np.sqrt((dx * dx + dy * dy) + dz * dz)
        for k in range(lanes):
            for leg in range(5):
                legs[start + k, leg] = found[leg, k]
