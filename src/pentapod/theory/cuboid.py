"""The largest box of grid nodes that are all inside."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools

Corner = tuple[int, int, int]


def largest_cuboid(inside: Bools) -> tuple[Corner, Corner] | None:
    """Return the first and last node of the box with the greatest volume all of whose nodes (nx, ny, nz) are inside.

    The volume is that between the nodes: a box one node thick has none. None where there is no box with a volume. Every
    pair of x is tried; for each, every pair of y at once, with the longest run along z.
    """
    if not inside.any():
        return None
    used = [np.flatnonzero(inside.any(axis=other)) for other in ((1, 2), (0, 2), (0, 1))]
    corner = [int(line[0]) for line in used]
    inside = inside[tuple(slice(line[0], line[-1] + 1) for line in used)]
    nx, ny, nz = inside.shape
    best, answer = 0, None
    for first in range(nx):
        layer = inside[first].copy()
        for last in range(first + 1, nx):
            layer &= inside[last]
            if not layer.any():
                break
            if (last - first) * (ny - 1) * (nz - 1) <= best:
                continue
            rows = np.flatnonzero(layer.any(axis=1))
            for start in rows:
                # together[k]: nodes z inside for all y of start … start + k
                together = np.logical_and.accumulate(layer[start : rows[-1] + 1], axis=0)
                if (last - first) * (len(together) - 1) * (nz - 1) <= best:
                    continue
                run, longest = np.zeros(len(together), dtype=np.intp), np.zeros(len(together), dtype=np.intp)
                end = np.zeros(len(together), dtype=np.intp)
                for z in range(nz):
                    run = np.where(together[:, z], run + 1, 0)
                    end = np.where(run > longest, z, end)
                    longest = np.maximum(longest, run)
                volume = (last - first) * np.arange(len(together)) * (longest - 1)
                pick = int(np.argmax(volume))
                if volume[pick] > best:
                    best = int(volume[pick])
                    stop = int(end[pick])
                    answer = (first, int(start), stop - int(longest[pick]) + 1), (last, int(start) + pick, stop)
    if answer is None:
        return None
    low, high = ((x + corner[0], y + corner[1], z + corner[2]) for x, y, z in answer)
    return low, high
