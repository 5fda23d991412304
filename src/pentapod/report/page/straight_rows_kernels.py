"""Rows of a motion that stand for the others, compiled: a run is split where it is farthest from its chord in time."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.numerics.kernels import kernel


@kernel
def mark_corners(times: Floats, points: Floats, most: float, keep: Bools) -> None:
    """Mark more rows in keep (N,), until all others lie within `most` of lines between marked ones.

    times (N,): ascending. points (N, 3 · k): of each of k points three coordinates. keep must already mark the first
    and the last row.
    """
    ends, first = np.empty(len(times), dtype=np.intp), 0
    for next_kept in range(1, len(times)):
        if not keep[next_kept]:
            continue
        ends[0], waiting = next_kept, 1
        while waiting > 0:
            last = ends[waiting - 1]
            farthest, worst = most * most, -1
            for row in range(first + 1, last):
                share = (times[row] - times[first]) / (times[last] - times[first])
                for k in range(0, points.shape[1], 3):
                    square = 0.0
                    for j in range(k, k + 3):
                        off = points[row, j] - points[first, j] - share * (points[last, j] - points[first, j])
                        square += off * off
                    if square > farthest:
                        farthest, worst = square, row
            if worst < 0:
                first = last
                waiting -= 1
            else:
                keep[worst] = True
                ends[waiting] = worst
                waiting += 1
