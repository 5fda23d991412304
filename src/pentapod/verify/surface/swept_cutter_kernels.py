"""Kernels for the swept volume of a solid of revolution: distances of points, and first hits of rays.

On each *stretch* of the motion the solid moves straight while its axis turns evenly. The real motion deviates from that
by at most the bound of the stretch, and the solid is shrunk by this bound. So what counts as removed is removed.

Where the axis never turns, all is in a frame whose z is that axis: distances take one root, boxes bound them closely.
"""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.mesh.query.kernels.box_kernels import open_node
from pentapod.numerics.kernels import kernel

STACK = 128
"""Largest number of waiting nodes of a tree, or of waiting cells."""
TURNS, BALL, FIXED = 0, 1, 2
"""Kinds of swept solids: those whose axis turns, balls, and those whose axis is z everywhere."""

Swept = tuple[Floats, Floats, Ints, Floats, float, int]
"""The swept volume of one solid: stretches (S, 13), boxes (2 L − 1, 6), starts (L + 1,), the solid (5,), wide, and its
kind. The boxes hold the axis of the solid, and no point of the solid is farther from it than `wide`."""

Room = tuple[Ints, Floats]
"""Memory of a search: nodes and their lower bounds, both (STACK,)."""

GOLDEN = 0.6180339887498949
GOLDEN_STEPS = 12
"""Steps of the golden-section search for the nearest place of a stretch."""
ENTERED_M = 1e-7
"""A ray that comes so close has entered."""
RAY_STEPS = 200
WAY_Z = 5
"""Index of z in the displacement of a stretch."""
BOX_TOP = 5
"""Index of the largest z of a box."""


@kernel
def _to_solid(h: float, out: float, solid: Floats) -> float:
    """Return the signed distance from a solid (5,) of a point at height h and radius `out`; negative inside."""
    low, high, first, last = solid[0], solid[1], solid[2], solid[3]
    # The wall from (low, first) to (high, last) in the half plane through the axis.
    along, across = high - low, last - first
    square = along * along + across * across
    t = 0.0
    if square > 0.0:
        t = min(max(((h - low) * along + (out - first) * across) / square, 0.0), 1.0)
    dh, dr = h - low - t * along, out - first - t * across
    wall = math.sqrt(dh * dh + dr * dr)
    if low <= h <= high and along > 0.0 and out <= first + (h - low) / along * across:
        side = (first + (h - low) / along * across - out) * along / math.sqrt(square)
        return -min(side, h - low, high - h) - solid[4]
    best = wall
    for end in range(2):
        level, radius = (low, first) if end == 0 else (high, last)
        over, above = max(out - radius, 0.0), h - level
        best = min(best, math.sqrt(over * over + above * above))
    return best - solid[4]


@kernel
def at_share(x: Floats, stretch: Floats, solid: Floats, share: float, kind: int) -> float:
    """Return the signed distance of a point from a solid, not a ball, at a share of a stretch (13,)."""
    if kind == FIXED:
        dx, dy = x[0] - stretch[0] - share * stretch[3], x[1] - stretch[1] - share * stretch[4]
        return _to_solid(x[2] - stretch[2] - share * stretch[WAY_Z], math.sqrt(dx * dx + dy * dy), solid)
    rest = 1.0 - share
    ax = rest * stretch[6] + share * stretch[9]
    ay = rest * stretch[7] + share * stretch[10]
    az = rest * stretch[8] + share * stretch[11]
    length = math.sqrt(ax * ax + ay * ay + az * az)
    ax, ay, az = ax / length, ay / length, az / length
    dx = x[0] - stretch[0] - share * stretch[3]
    dy = x[1] - stretch[1] - share * stretch[4]
    dz = x[2] - stretch[2] - share * stretch[WAY_Z]
    h = dx * ax + dy * ay + dz * az
    out = math.sqrt(max(dx * dx + dy * dy + dz * dz - h * h, 0.0))
    return _to_solid(h, out, solid)


@kernel
def to_stretch(x: Floats, stretch: Floats, solid: Floats, kind: int) -> tuple[float, float]:
    """Return the signed distance of a point from a solid on a stretch, and the share of it where that is least.

    stretch (13,): start and displacement of the solid's origin, axis at start and end, bound on the deviation.
    """
    if kind == BALL:
        dx, dy, dz = x[0] - stretch[0], x[1] - stretch[1], x[2] - stretch[2]
        wx, wy, wz = stretch[3], stretch[4], stretch[WAY_Z]
        square = wx * wx + wy * wy + wz * wz
        t = 0.0
        if square > 0.0:
            t = min(max((dx * wx + dy * wy + dz * wz) / square, 0.0), 1.0)
        dx, dy, dz = dx - t * wx, dy - t * wy, dz - t * wz
        return math.sqrt(dx * dx + dy * dy + dz * dz) - solid[4] + stretch[12], t
    # The distance from a convex body is convex along a straight line.
    low, high = 0.0, 1.0
    a, b = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    fa, fb = at_share(x, stretch, solid, a, kind), at_share(x, stretch, solid, b, kind)
    for _ in range(GOLDEN_STEPS):
        if fa <= fb:
            high, b, fb = b, a, fa
            a = high - GOLDEN * (high - low)
            fa = at_share(x, stretch, solid, a, kind)
        else:
            low, a, fa = a, b, fb
            b = low + GOLDEN * (high - low)
            fb = at_share(x, stretch, solid, b, kind)
    best, share = (fa, a) if fa <= fb else (fb, b)
    for end in range(2):
        value = at_share(x, stretch, solid, float(end), kind)
        if value < best:
            best, share = value, float(end)
    return best + stretch[12], share


@kernel
def _may_be_nearer(x: Floats, stretch: Floats, solid: Floats, best: float, kind: int) -> bool:
    """Return whether a solid may come nearer to a point on a stretch than `best`: a convex function is above chords.

    From its middle it cannot fall to one end by more than it has risen from there to the other.
    """
    first, middle, last = (
        at_share(x, stretch, solid, 0.0, kind),
        at_share(x, stretch, solid, 0.5, kind),
        at_share(x, stretch, solid, 1.0, kind),
    )
    return min(first, last, 2.0 * middle - max(first, last)) + stretch[12] < best


@kernel
def _to_box(x: Floats, box: Floats, solid: Floats, wide: float, kind: int) -> float:
    """Return a lower bound of the signed distance of a point from a solid whose axis is in a box (6,)."""
    dx, dy = max(box[0] - x[0], 0.0, x[0] - box[3]), max(box[1] - x[1], 0.0, x[1] - box[4])
    dz = max(box[2] - x[2], x[2] - box[BOX_TOP])
    square = dx * dx + dy * dy
    if kind == FIXED:
        out = math.sqrt(square) - max(solid[2], solid[3])
        if out <= 0.0 or dz <= 0.0:
            return max(out, dz) - solid[4]
        return math.sqrt(out * out + dz * dz) - solid[4]
    dz = max(dz, 0.0)
    return math.sqrt(square + dz * dz) - wide


@kernel
def nearest_stretch(
    x: Floats, warm: int, enough: float, within: float, swept: Swept, room: Room
) -> tuple[float, int, float]:
    """Return the signed distance of a point from the swept volume, the nearest stretch, and the share of it.

    Ends at the first place that is not farther than `enough`. within: only what is nearer is searched; where nothing
    is, it is the distance. warm: a stretch to start with, −1 for none; returned where nothing is nearer.
    """
    stretches, boxes, starts, solid, wide, kind = swept
    nodes, bounds = room
    best, facet, where = within, warm, 0.0
    if warm >= 0:
        distance, share = to_stretch(x, stretches[warm], solid, kind)
        if distance < best:
            best, where = distance, share
            if best <= enough:
                return best, facet, where
    leaves = len(starts) - 1
    nodes[0], bounds[0] = 0, _to_box(x, boxes[0], solid, wide, kind)
    count = 1
    while count > 0:
        count -= 1
        node = nodes[count]
        if bounds[count] >= best:
            continue
        leaf = node - (leaves - 1)
        if leaf < 0:
            near = _to_box(x, boxes[2 * node + 1], solid, wide, kind)
            far = _to_box(x, boxes[2 * node + 2], solid, wide, kind)
            count = open_node(node, near, far, best, count, nodes, bounds)
        else:
            for k in range(starts[leaf], starts[leaf + 1]):
                if k == warm or not (kind == BALL or _may_be_nearer(x, stretches[k], solid, best, kind)):
                    continue
                distance, share = to_stretch(x, stretches[k], solid, kind)
                if distance < best:
                    best, facet, where = distance, k, share
                    if best <= enough:
                        return best, facet, where
    return best, facet, where


@kernel
def entry(q: Floats, n: Floats, most: float, warm: int, swept: Swept, room: Room) -> tuple[float, int]:
    """Return the height along a normal at which a ray from q enters the swept volume, up to `most`; the stretch."""
    t, x = 0.0, np.empty(3)
    # Where the ray begins on the far side of what was cut from there, steps are short: its middle often tells at once.
    for i in range(3):
        x[i] = q[i] + 0.5 * most * n[i]
    if nearest_stretch(x, warm, 0.0, 0.5 * most, swept, room)[0] >= 0.5 * most:
        return most, warm
    for _ in range(RAY_STEPS):
        for i in range(3):
            x[i] = q[i] + t * n[i]
        gap, warm, _ = nearest_stretch(x, warm, ENTERED_M, most - t, swept, room)
        if gap >= most - t:
            return most, warm
        if gap <= ENTERED_M:
            return t, warm
        t += gap
    return t, warm


@kernel
def entries(points: Floats, normals: Floats, swept: Swept, heights: Floats) -> None:
    """Lower heights (N,) to where rays from points along normals (N, 3) enter the swept volume."""
    room, warm = (np.empty(STACK, dtype=np.intp), np.empty(STACK)), -1
    for k in range(len(points)):
        height, warm = entry(points[k], normals[k], heights[k], warm, swept, room)
        heights[k] = min(heights[k], height)


@kernel
def distances(points: Floats, swept: Swept, gaps: Floats) -> None:
    """Lower gaps (N,) to the signed distances of points (N, 3) from the swept volume."""
    room, warm = (np.empty(STACK, dtype=np.intp), np.empty(STACK)), -1
    for k in range(len(points)):
        gaps[k], warm, _ = nearest_stretch(points[k], warm, -math.inf, gaps[k], swept, room)
