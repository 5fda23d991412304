"""Least distance of a point that moves straight on from a box and from a facet, by tangents of convex functions.

Both distances are convex functions of time: two tangents bound them from below, and a few more find the minimum.
Nothing has to be halved in space, so a ball that touches a smooth surface needs a dozen facets.
"""

from __future__ import annotations

import math

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import kernel

_ROUNDS = 40


@kernel
def _to_box(box: Floats, x: float, y: float, z: float, g: Floats) -> float:
    """Return the distance of a point from a box (15,); write the vector from the box to the point into g (3,)."""
    x, y, z = x - box[0], y - box[1], z - box[2]
    g[0] = g[1] = g[2] = 0.0
    square = 0.0
    for k in range(3):
        a, b, c = box[6 + 3 * k], box[7 + 3 * k], box[8 + 3 * k]
        along = x * a + y * b + z * c
        over = max(abs(along) - box[3 + k], 0.0)
        square += over * over
        if along < 0.0:
            over = -over
        g[0] += over * a
        g[1] += over * b
        g[2] += over * c
    return math.sqrt(square)


@kernel
def to_facet(p: Floats, x: float, y: float, z: float, g: Floats) -> float:
    """Return the distance of a point from a facet (3, 3); write the vector from the facet to the point into g (3,).

    Ericson, Real-Time Collision Detection, section 5.1.5.
    """
    abx, aby, abz = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    acx, acy, acz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
    apx, apy, apz = x - p[0, 0], y - p[0, 1], z - p[0, 2]
    d1, d2 = abx * apx + aby * apy + abz * apz, acx * apx + acy * apy + acz * apz
    v, w = 0.0, 0.0
    if not (d1 <= 0.0 and d2 <= 0.0):
        bpx, bpy, bpz = x - p[1, 0], y - p[1, 1], z - p[1, 2]
        d3, d4 = abx * bpx + aby * bpy + abz * bpz, acx * bpx + acy * bpy + acz * bpz
        cpx, cpy, cpz = x - p[2, 0], y - p[2, 1], z - p[2, 2]
        d5, d6 = abx * cpx + aby * cpy + abz * cpz, acx * cpx + acy * cpy + acz * cpz
        va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
        if d3 >= 0.0 and d4 <= d3:
            v = 1.0
        elif d6 >= 0.0 and d5 <= d6:
            w = 1.0
        elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
            v = d1 / (d1 - d3)
        elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
            w = d2 / (d2 - d6)
        elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
            w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
            v = 1.0 - w
        else:
            total = va + vb + vc
            v, w = vb / total, vc / total
    g[0] = apx - v * abx - w * acx
    g[1] = apy - v * aby - w * acy
    g[2] = apz - v * abz - w * acz
    return math.sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2])


@kernel
def _slope(g: Floats, distance: float, way: Floats) -> float:
    """Return the change of the distance with time where it is known; 0 inside, where it stays 0."""
    if distance <= 0.0:
        return 0.0
    return (g[0] * way[0] + g[1] * way[1] + g[2] * way[2]) / distance


@kernel
def lower_bound(box: Floats, start: Floats, way: Floats, enough: float, g: Floats) -> float:
    """Return a lower bound, not below the minimum's tangents, on the distance of a moving point from a box."""
    first = _to_box(box, start[0], start[1], start[2], g)
    rising = _slope(g, first, way)
    if rising >= 0.0 or first + rising >= enough:
        return max(first + min(rising, 0.0), 0.0)
    last = _to_box(box, start[0] + way[0], start[1] + way[1], start[2] + way[2], g)
    falling = _slope(g, last, way)
    if falling <= 0.0:
        return last
    # Where the tangents meet.
    t = (last - falling - first) / (rising - falling)
    return max(first + rising * t, 0.0)


@kernel
def nearest_time(p: Floats, start: Floats, way: Floats, g: Floats) -> tuple[float, float]:
    """Return the smallest distance of a moving point from a facet, and when. Leaves g (3,) as it is then."""
    t0, t1 = 0.0, 1.0
    d0 = to_facet(p, start[0], start[1], start[2], g)
    s0 = _slope(g, d0, way)
    if s0 >= 0.0:
        return d0, 0.0
    d1 = to_facet(p, start[0] + way[0], start[1] + way[1], start[2] + way[2], g)
    s1 = _slope(g, d1, way)
    if s1 <= 0.0:
        return d1, 1.0
    best, when = (d0, 0.0) if d0 < d1 else (d1, 1.0)
    for round_ in range(_ROUNDS):
        meet = (d1 - s1 * t1 - d0 + s0 * t0) / (s0 - s1)
        if d0 + s0 * (meet - t0) >= best - 1e-9:
            break
        # Tangents creep towards a kink; every third time the middle is taken.
        t = 0.5 * (t0 + t1) if round_ % 3 == 2 or not t0 < meet < t1 else meet
        d = to_facet(p, start[0] + t * way[0], start[1] + t * way[1], start[2] + t * way[2], g)
        s = _slope(g, d, way)
        if d < best:
            best, when = d, t
        if s < 0.0:
            t0, d0, s0 = t, d, s
        elif s > 0.0:
            t1, d1, s1 = t, d, s
        else:
            break
    to_facet(p, start[0] + when * way[0], start[1] + when * way[1], start[2] + when * way[2], g)
    return best, when
