"""Kernels for the material that a swept cutter leaves: adaptive subdivision of a surface into cells proven covered."""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import kernel
from pentapod.verify.surface.swept_cutter_kernels import (
    BALL,
    ENTERED_M,
    STACK,
    Room,
    Swept,
    at_share,
    entry,
    nearest_stretch,
    to_stretch,
)


@kernel
def _covers(corners: Floats, rise: Floats, stretch: Floats, solid: Floats, kind: int, share: float) -> bool:
    """Return whether a solid on one stretch contains a whole triangle (3, 3), moved by `rise` (3,).

    The swept volume of a ball along a straight stretch is convex, so its corners may be inside at different places;
    those of other solids must be inside at one place.
    """
    x = np.empty(3)
    for j in range(3):
        for i in range(3):
            x[i] = corners[j, i] + rise[i]
        if kind == BALL:
            if to_stretch(x, stretch, solid, kind)[0] > 0.0:
                return False
        elif at_share(x, stretch, solid, share, kind) + stretch[12] > 0.0:
            return False
    return True


@kernel
def _halve(cells: Floats, count: int) -> None:
    """Halve the triangle cells[count − 1] (3, 3) across its longest side; the halves are count − 1 and count."""
    cell, longest, side = cells[count - 1], -1.0, 0
    for j in range(3):
        square = 0.0
        for i in range(3):
            square += (cell[(j + 1) % 3, i] - cell[j, i]) ** 2
        if square > longest:
            longest, side = square, j
    after = (side + 1) % 3
    for i in range(3):
        middle = 0.5 * (cell[side, i] + cell[after, i])
        for j in range(3):
            cells[count, j, i] = cell[j, i]
        cells[count, side, i] = middle
        cell[after, i] = middle


@kernel
def _middle(cell: Floats, middle: Floats) -> float:
    """Write the middle (3,) of a triangle (3, 3), and return the largest distance of its corners from it."""
    for i in range(3):
        middle[i] = (cell[0, i] + cell[1, i] + cell[2, i]) / 3.0
    most = 0.0
    for j in range(3):
        square = 0.0
        for i in range(3):
            square += (cell[j, i] - middle[i]) ** 2
        most = max(most, square)
    return math.sqrt(most)


@kernel
def _deepen(q: Floats, n: Floats, most: float, warm: int, swept: Swept, room: Room, deepest: Floats) -> None:
    """Raise deepest (4,), a height and its place, to the height that is left above q, at most `most`, if larger."""
    x = np.empty(3)
    for i in range(3):
        x[i] = q[i] + deepest[0] * n[i]
    if nearest_stretch(x, warm, 0.0, 1e-12, swept, room)[0] <= 0.0:
        return
    left = entry(q, n, most, warm, swept, room)[0]
    if left > deepest[0]:
        deepest[0] = left
        for i in range(3):
            deepest[1 + i] = q[i]


@kernel
def uncovered(
    corners: Floats,
    normals: Floats,
    height: float,
    coarse: float,
    fine: float,
    swept: Swept,
    deepest: Floats,
    found: Floats,
) -> int:
    """Fill found (K, 12): corners and normal of the cells of triangles (N, 3, 3) that are not proven covered.

    Covered: the solid has contained every point at `height` above the cell, along the normal (N, 3), so no more is left
    there. Cells are halved until that is proven or their radius is `fine`; `coarse` where the solid never comes close.
    Returns how many there are; if that is more than K, not all were written. deepest (4,): raised to the largest height
    that is left at the middle of a covered cell, and its place.
    """
    stretches, _, _, solid, _, kind = swept
    room, warm = (np.empty(STACK, dtype=np.intp), np.empty(STACK)), -1
    cells, middle, x, rise = np.empty((STACK, 3, 3)), np.empty(3), np.empty(3), np.empty(3)
    total = 0
    for f in range(len(corners)):
        for i in range(3):
            rise[i] = height * normals[f, i]
        cells[0] = corners[f]
        count = 1
        while count > 0:
            cell = cells[count - 1]
            reach = _middle(cell, middle)
            for i in range(3):
                x[i] = middle[i] + rise[i]
            if reach > coarse and count < STACK:
                _halve(cells, count)
                count += 1
                continue
            halves = reach > fine and count < STACK
            # The first place that holds the middle covers most cells. Where it does not, the deepest one decides.
            within = ENTERED_M + (reach if halves else 0.0)
            gap, warm, share = nearest_stretch(x, warm, 0.0, within, swept, room)
            covered = gap <= 0.0 and _covers(cell, rise, stretches[warm], solid, kind, share)
            if gap <= 0.0 and not covered:
                gap, warm, share = nearest_stretch(x, warm, -reach, within, swept, room)
                covered = gap <= -reach or _covers(cell, rise, stretches[warm], solid, kind, share)
            if covered:
                count -= 1
                _deepen(middle, normals[f], height, warm, swept, room, deepest)
                continue
            if gap <= reach and halves:
                _halve(cells, count)
                count += 1
                continue
            if total < len(found):
                for i in range(3):
                    found[total, 9 + i] = normals[f, i]
                    for j in range(3):
                        found[total, 3 * j + i] = cell[j, i]
            total += 1
            count -= 1
    return total
