"""Minimum distance of a linearly moving point from a box and from a facet, by tangents of convex functions.

Both distances are convex functions of time: two tangents bound them from below, and a few more find the minimum.
No box has to be subdivided, so a ball that touches a smooth surface needs about a dozen facets.
"""

from __future__ import annotations

import math

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import kernel

ROUNDS = 40
"""Evaluations after which the search for a minimum ends; rarely more than ten are needed."""

EXACT_M = 1e-9
"""Metres to which a minimum distance is exact."""


@kernel
def _box_distance(box: Floats, x: float, y: float, z: float, g: Floats) -> float:
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
def facet_square(p: Floats, x: float, y: float, z: float, g: Floats) -> float:
    """Return the squared distance of a point from a facet (3, 3); write the vector from it to the point into g (3,).

    Ericson, Real-Time Collision Detection, section 5.1.5; what he takes from the second and third corner is had from
    the first one and the products of the sides. Whatever rounding does to it, it is the distance from a place of the
    facet.
    """
    abx, aby, abz = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    acx, acy, acz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
    apx, apy, apz = x - p[0, 0], y - p[0, 1], z - p[0, 2]
    d1, d2 = abx * apx + aby * apy + abz * apz, acx * apx + acy * apy + acz * apz
    v, w = 0.0, 0.0
    if not (d1 <= 0.0 and d2 <= 0.0):
        cosine = abx * acx + aby * acy + abz * acz
        d3, d4 = d1 - (abx * abx + aby * aby + abz * abz), d2 - cosine
        d5, d6 = d1 - cosine, d2 - (acx * acx + acy * acy + acz * acz)
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
    gx, gy, gz = apx - v * abx - w * acx, apy - v * aby - w * acy, apz - v * abz - w * acz
    g[0], g[1], g[2] = gx, gy, gz
    return gx * gx + gy * gy + gz * gz


@kernel
def facet_distance(p: Floats, x: float, y: float, z: float, g: Floats) -> float:
    """Return the distance of a point from a facet (3, 3); write the vector from the facet to the point into g (3,)."""
    return math.sqrt(facet_square(p, x, y, z, g))


@kernel
def slope(g: Floats, distance: float, travel: Floats) -> float:
    """Return the derivative of a distance by time, from the vector g (3,) to the point; 0 at distance 0."""
    if distance <= 0.0:
        return 0.0
    return (g[0] * travel[0] + g[1] * travel[1] + g[2] * travel[2]) / distance


@kernel
def lower_bound(box: Floats, start: Floats, travel: Floats, enough: float, g: Floats) -> float:
    """Return the lower bound by the tangents at both ends of the distance of a moving point from a box (15,)."""
    first = _box_distance(box, start[0], start[1], start[2], g)
    start_slope = slope(g, first, travel)
    if start_slope >= 0.0 or first + start_slope >= enough:
        return max(first + min(start_slope, 0.0), 0.0)
    last = _box_distance(box, start[0] + travel[0], start[1] + travel[1], start[2] + travel[2], g)
    end_slope = slope(g, last, travel)
    if end_slope <= 0.0:
        return last
    # Where the tangents meet.
    t = (last - end_slope - first) / (start_slope - end_slope)
    return max(first + start_slope * t, 0.0)


@kernel
def nearest_time(p: Floats, start: Floats, travel: Floats, enough: float, g: Floats) -> tuple[float, float]:
    """Return the minimum distance of a moving point from a facet, and when; g (3,) is left as it is then.

    Where the minimum is not below `enough`, the search ends early: it returns a distance that is not below `enough`,
    and g is of no use.
    """
    t0, t1 = 0.0, 1.0
    d0 = facet_distance(p, start[0], start[1], start[2], g)
    s0 = slope(g, d0, travel)
    if s0 >= 0.0 or d0 + s0 >= enough:
        return d0, 0.0
    d1 = facet_distance(p, start[0] + travel[0], start[1] + travel[1], start[2] + travel[2], g)
    s1 = slope(g, d1, travel)
    if s1 <= 0.0:
        return d1, 1.0
    best, when = (d0, 0.0) if d0 < d1 else (d1, 1.0)
    for round_ in range(ROUNDS):
        meet = (d1 - s1 * t1 - d0 + s0 * t0) / (s0 - s1)
        if d0 + s0 * (meet - t0) >= min(enough, best - EXACT_M):
            break
        # At a kink tangents converge slowly: every third time the middle is taken.
        t = 0.5 * (t0 + t1) if round_ % 3 == 2 or not t0 < meet < t1 else meet
        d = facet_distance(p, start[0] + t * travel[0], start[1] + t * travel[1], start[2] + t * travel[2], g)
        s = slope(g, d, travel)
        if d < best:
            best, when = d, t
        if s < 0.0:
            t0, d0, s0 = t, d, s
        elif s > 0.0:
            t1, d1, s1 = t, d, s
        else:
            break
    if best < enough:
        facet_distance(p, start[0] + when * travel[0], start[1] + when * travel[1], start[2] + when * travel[2], g)
    return best, when
