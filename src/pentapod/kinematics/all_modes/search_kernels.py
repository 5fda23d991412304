"""Branch and prune over all poses of five legs, compiled: lemma 17 of docs/proofs.md.

Arrays as in `krawczyk_kernels`; rings (5, 9) always, with r = 0 for joints on the line. Boxes are rows (12,): lower
ends of (p, i), then upper ones. Each is within an octant of directions, so no component of i changes its sign.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.all_modes.linear_kernels import reduced
from pentapod.kinematics.krawczyk.krawczyk_kernels import (
    ROUND,
    contracted,
    fill_defect,
    fill_line,
    fill_spread,
    invert,
)
from pentapod.kinematics.proofs.newton_kernels import equations, solved
from pentapod.numerics.kernels import kernel

Room: TypeAlias = tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats]
"""first, second, change, step, jacobian, inverse, work, defect, spread, spread_i, g, z: as in `krawczyk_kernels`."""


@kernel
def search(
    lengths: Floats,
    geometry: Floats,
    rings: Floats,
    roots: Floats,
    reaches: Floats,
    slack: float,
    stack: Floats,
    most_boxes: int,
    narrow: float,
    gain: float,
) -> tuple[int, int, bool]:
    """Fill all poses of these lengths (5,); return how many, how many boxes were looked at, and whether these are all.

    roots, reaches (K, 6): poses, and boxes around them in which there is no other one. slack: what rounding and errors
    of the lengths may add to G, m². stack (M, 12): room for boxes. most_boxes: at which the search ends. narrow: half
    width of a box's directions from which a pose is looked for in it. gain: share of a box's width beyond which it is
    not pruned again but halved.
    """
    room = (
        np.zeros((5, 3)), np.zeros((5, 3)), np.zeros((5, 3)), np.zeros(6), np.zeros((6, 6)), np.zeros((6, 6)),
        np.zeros((6, 12)), np.zeros((6, 6)), np.zeros((5, 3)), np.zeros(3), np.zeros(6), np.zeros(6),
    )  # fmt: skip
    depth, count, boxes = _octants(lengths, geometry, rings, slack, stack), 0, 0
    while depth > 0:
        depth -= 1
        boxes += 1
        if boxes > most_boxes or depth + 2 >= len(stack) or count == len(roots):
            return count, boxes, False
        left, count = _pruned(stack[depth], lengths, geometry, rings, roots, reaches, count, slack, narrow, gain, room)
        if left:
            if not _halved(stack[depth], stack[depth + 1], geometry[5, 2]):
                return count, boxes, False
            depth += 2
    return count, boxes, True


@kernel
def _pruned(
    box: Floats,
    lengths: Floats,
    geometry: Floats,
    rings: Floats,
    roots: Floats,
    reaches: Floats,
    count: int,
    slack: float,
    narrow: float,
    gain: float,
    room: Room,
) -> tuple[bool, int]:
    """Cut a box as long as it gets smaller; return whether anything is left, and how many poses are known."""
    first, second, change, step, jacobian, inverse, work, defect, spread, spread_i, g, z = room
    centre, half = np.empty(6), np.empty(6)
    shrinks = True
    while shrinks and count < len(roots):
        if not _on_sphere(box):
            return False, count
        for n in range(6):
            centre[n] = 0.5 * (box[n] + box[6 + n])
            half[n] = 0.5 * (box[6 + n] - box[n]) * (1.0 + 2.0**-50) + 2.0**-52 * abs(centre[n])
        if _within(centre, half, roots, reaches, count):
            return False, count
        fill_line(centre, centre, geometry, first, second, change, step, jacobian, rings)
        equations(centre, lengths, first, rings, g)
        if not reduced(box, centre, half, lengths, geometry, rings, first, jacobian, g, slack):
            return False, count
        known = count
        if invert(jacobian, work, inverse):
            fill_defect(inverse, jacobian, defect)
            fill_spread(geometry, change, step, half, spread, spread_i)
            contracted(inverse, defect, geometry, rings, spread, spread_i, half, z)
            left, inside = _newton_pruned(box, centre, half, inverse, g, slack, z)
            if not left:
                return False, count
            if inside or max(half[3], half[4], half[5]) < narrow:
                count += _found(centre, half, lengths, geometry, rings, roots, reaches, count, slack, room)
        now, before = 0.0, 0.0
        for n in range(6):
            now += 0.5 * (box[6 + n] - box[n])
            before += half[n]
        shrinks = count > known or now < gain * before
    return True, count


@kernel
def _found(
    centre: Floats,
    half: Floats,
    lengths: Floats,
    geometry: Floats,
    rings: Floats,
    roots: Floats,
    reaches: Floats,
    count: int,
    slack: float,
    room: Room,
) -> int:
    """Look for a pose in or near a box by Newton's method; return 1 if a new one is proven and added, else 0."""
    first, second, change, step, jacobian, inverse, work, _, _, _, g, _ = room
    x = roots[count]
    x[:] = centre
    if not solved(x, lengths, geometry, rings, first, second, change, step, jacobian, work, inverse, g):
        return 0
    for n in range(6):
        if not abs(x[n] - centre[n]) <= 2.0 * half[n]:
            return 0
    if _within(x, np.zeros(6), roots, reaches, count):
        return 0
    return 1 if _alone(x, reaches[count], lengths, geometry, rings, slack, room) else 0


@kernel
def _alone(
    x: Floats, reach: Floats, lengths: Floats, geometry: Floats, rings: Floats, slack: float, room: Room
) -> bool:
    """Return whether exactly one pose is within `reach` (6,) of x; fill it as large as Krawczyk's test allows."""
    first, second, change, step, jacobian, inverse, work, defect, spread, spread_i, g, z = room
    fill_line(x, x, geometry, first, second, change, step, jacobian, rings)
    if not invert(jacobian, work, inverse):
        return False
    fill_defect(inverse, jacobian, defect)
    equations(x, lengths, first, rings, g)
    longest, share = lengths.max(), 1.0
    while share > 2.0**-30:
        for n in range(6):
            reach[n] = share * (longest if n < 3 else 1.0)
        fill_spread(geometry, change, step, reach, spread, spread_i)
        contracted(inverse, defect, geometry, rings, spread, spread_i, reach, z)
        kept = True
        for r in range(6):
            off, loose = _correction(inverse, g, slack, r)
            kept = kept and abs(off) + loose + z[r] < reach[r]
        if kept:
            return True
        share *= 0.5
    return False


@kernel
def _correction(inverse: Floats, g: Floats, slack: float, r: int) -> tuple[float, float]:
    """Return component r of C G and by how much it may be off."""
    total, loose = inverse[r, 5] * g[5], 4.0 * ROUND * abs(inverse[r, 5])
    for n in range(5):
        total += inverse[r, n] * g[n]
        loose += slack * abs(inverse[r, n])
    return total, loose


@kernel
def _newton_pruned(
    box: Floats, centre: Floats, half: Floats, inverse: Floats, g: Floats, slack: float, z: Floats
) -> tuple[bool, bool]:
    """Cut a box to Krawczyk's image of it; return whether anything is left, and whether the image is inside."""
    inside = True
    for r in range(6):
        off, loose = _correction(inverse, g, slack, r)
        if not np.isfinite(off + z[r]):
            return True, False
        low, high = centre[r] - off - z[r] - loose, centre[r] - off + z[r] + loose
        inside = inside and low > centre[r] - half[r] and high < centre[r] + half[r]
        box[r], box[6 + r] = max(box[r], low), min(box[6 + r], high)
        if box[r] > box[6 + r]:
            return False, False
    return True, inside


@kernel
def _octants(lengths: Floats, geometry: Floats, rings: Floats, slack: float, stack: Floats) -> int:
    """Fill the boxes of the eight octants of directions; return how many have room for a position."""
    count = 0
    for octant in range(8):
        box = stack[count]
        for n in range(3):
            positive = octant >> n & 1
            box[3 + n], box[9 + n] = (0.0, 1.0) if positive else (-1.0, 0.0)
            low, high = -np.inf, np.inf
            for j in range(5):
                z, far = geometry[j, 3], (lengths[j] + rings[j, 8] + slack / lengths[j]) * (1.0 + ROUND)
                one, other = z * box[3 + n], z * box[9 + n]
                low = max(low, geometry[j, n] - max(one, other) - far)
                high = min(high, geometry[j, n] - min(one, other) + far)
            box[n], box[6 + n] = low - ROUND * geometry[5, 2], high + ROUND * geometry[5, 2]
        count += box[0] <= box[6] and box[1] <= box[7] and box[2] <= box[8]
    return count


@kernel
def _on_sphere(box: Floats) -> bool:
    """Cut the directions of a box to those of length 1, in its octant; return whether there are any."""
    for _ in range(2):
        for n in range(3):
            near, far = 0.0, 0.0
            for m in range(3):
                if m != n:
                    low, high = abs(box[3 + m]), abs(box[9 + m])
                    near += min(low, high) ** 2
                    far += max(low, high) ** 2
            if near > 1.0 + ROUND:
                return False
            most = np.sqrt(max(0.0, 1.0 - near)) + ROUND
            least = np.sqrt(max(0.0, 1.0 - far - 4.0 * ROUND)) * (1.0 - ROUND)
            if box[9 + n] > 0.0:
                box[3 + n], box[9 + n] = max(box[3 + n], least), min(box[9 + n], most)
            else:
                box[3 + n], box[9 + n] = max(box[3 + n], -most), min(box[9 + n], -least)
            if box[3 + n] > box[9 + n]:
                return False
    return True


@kernel
def _within(centre: Floats, half: Floats, roots: Floats, reaches: Floats, count: int) -> bool:
    """Return whether a box is within the reach of one of the poses."""
    for k in range(count):
        inside = True
        for n in range(6):
            inside = inside and abs(centre[n] - roots[k, n]) + half[n] < reaches[k, n] * (1.0 - ROUND)
        if inside:
            return True
    return False


@kernel
def _halved(box: Floats, other: Floats, size: float) -> bool:
    """Halve a box where it is widest, the other half into `other`; return False where it is as narrow as rounding."""
    widest, at = 0.0, 0
    for n in range(6):
        width = (box[6 + n] - box[n]) * (2.0 / size if n < 3 else 1.0)
        if width > widest:
            widest, at = width, n
    if not widest > 2.0**-40:
        return False
    other[:] = box
    middle = 0.5 * (box[at] + box[6 + at])
    box[6 + at] = middle
    other[at] = middle
    return True
