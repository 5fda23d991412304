"""Height at which a cutter that is dropped comes to rest on a mesh, by branch and bound through the tree of boxes.

The cutter is all that is within a radius of an upright disc, and above: a ball where the disc has no radius of its own,
a bull-nose end, a flat end where nothing is within. It rests on a facet, an edge or a vertex. Where a point of the mesh
is ρ beside the axis, the disc is √(radius² − max(ρ − disc, 0)²) above it: a concave function, so that one place of an
edge holds the cutter. For a ball that is a closed form; else Newton's method finds it, between bounds.
"""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.mesh.query.kernels.segment_kernels import STACK
from pentapod.numerics.kernels import kernel

_ROUNDS = 50
_EXACT = 1e-15
_TIE = 1e-12
"""Metres: of places at the same height, the nearest to the axis counts as touched."""
_CLOSE = 1e-12
"""Share of the squared size of a facet by which the place that holds a cutter may seem to be inside an edge."""


@kernel
def _rise(aside: float, radius: float, disc: float) -> float:
    """Return how high the disc is above a point that is `aside` metres beside the axis; −inf beyond the cutter."""
    beyond = max(aside - disc, 0.0)
    below = radius * radius - beyond * beyond
    return math.sqrt(below) if below >= 0.0 else -math.inf


@kernel
def _touch(
    best: float, height: float, qx: float, qy: float, qz: float, steep: float, x: float, y: float, touch: Floats
) -> float:
    """Return the higher of two heights; fill touch (4,) with the place and the slope of what holds the cutter there."""
    if height < best - _TIE or height == -math.inf:
        return best
    if height > best + _TIE or (qx - x) ** 2 + (qy - y) ** 2 < (touch[0] - x) ** 2 + (touch[1] - y) ** 2:
        touch[0], touch[1], touch[2], touch[3] = qx, qy, qz, steep
    return max(best, height)


@kernel
def _reach_along(aside: float, slope: float, radius: float, disc: float) -> float:
    """Return how far from its foot a line touches the cutter that passes the axis `aside` metres beside it, and rises.

    slope: per metre, not negative. aside: less than the cutter's radius.
    """
    if disc == 0.0:
        return math.sqrt(radius * radius - aside * aside) * slope / math.sqrt(1.0 + slope * slope)
    if radius == 0.0:
        return math.sqrt(disc * disc - aside * aside) if slope > 0.0 else 0.0
    if slope == 0.0:
        return 0.0
    # With the angle θ between the cutter's normal and its axis: tan θ √(1 − (aside / ρ)²) = slope, ρ = disc + r sin θ.
    low, high = math.atan(slope), 0.5 * math.pi
    if aside > disc:
        low = max(low, math.asin(min((aside - disc) / radius, 1.0)))
    angle, along = low, 0.0
    for number in range(_ROUNDS):
        if number == 0:
            angle = 0.5 * (low + high) if aside > disc else low
        sine, cosine = math.sin(angle), math.cos(angle)
        out = disc + radius * sine
        along = math.sqrt(max(out * out - aside * aside, 0.0))
        share = along / out
        value = sine * share - slope * cosine
        if value < 0.0:
            low = angle
        else:
            high = angle
        if value == 0.0 or high - low < _EXACT:
            break
        rate = cosine * share + slope * sine
        if along > 0.0:
            rate += sine * aside * aside * radius * cosine / (out * out * along)
        ahead = angle - value / rate
        if abs(ahead - angle) < _EXACT:
            break
        angle = ahead if low < ahead < high else 0.5 * (low + high)
    return along


@kernel
def _on_vertex(a: Floats, x: float, y: float, radius: float, disc: float, best: float, touch: Floats) -> float:
    """Return `best`, or the disc's height at (x, y) where the cutter rests higher on a vertex (3,)."""
    out = math.sqrt((x - a[0]) ** 2 + (y - a[1]) ** 2)
    steep = max(out - disc, 0.0) / radius if radius > 0.0 else 0.0
    return _touch(best, a[2] + _rise(out, radius, disc), a[0], a[1], a[2], steep, x, y, touch)


@kernel
def _on_edge(a: Floats, b: Floats, x: float, y: float, radius: float, disc: float, best: float, touch: Floats) -> float:
    """Return `best`, or the disc's height at (x, y) where the cutter rests higher on an edge from a (3,) to b (3,)."""
    wx, wy, dx, dy = x - a[0], y - a[1], b[0] - a[0], b[1] - a[1]
    length = math.sqrt(dx * dx + dy * dy)
    if length == 0.0:
        return _on_vertex(a if a[2] > b[2] else b, x, y, radius, disc, best, touch)
    dx, dy = dx / length, dy / length
    aside = abs(wx * dy - wy * dx)
    if aside >= radius + disc:
        return best
    along, slope = wx * dx + wy * dy, (b[2] - a[2]) / length
    reach = math.copysign(_reach_along(aside, abs(slope), radius, disc), slope)
    # Of a level edge the nearest place.
    at = along + reach if reach != 0.0 else min(max(along, 0.0), length)
    if at <= 0.0 or at >= length:
        return _on_vertex(a if at <= 0.0 else b, x, y, radius, disc, best, touch)
    out = math.sqrt(aside * aside + (at - along) ** 2)
    qz = a[2] + at * slope
    if radius > 0.0:
        steep = min(max(out - disc, 0.0) / radius, 1.0)
    elif reach != 0.0:
        out, steep = disc, abs(slope) * disc / abs(reach)
        steep = steep / math.sqrt(1.0 + steep * steep)
    else:
        steep = 0.0
    return _touch(best, qz + _rise(out, radius, disc), a[0] + at * dx, a[1] + at * dy, qz, steep, x, y, touch)


@kernel
def _on_facet(p: Floats, x: float, y: float, radius: float, disc: float, best: float, touch: Floats) -> float:
    """Return `best`, or the disc's height at (x, y) where the cutter rests higher on a facet (3, 3).

    The height at which a point of the facet's plane holds the cutter is a concave function of it. So the facet holds it
    where the plane does, or on an edge beyond which that place is.
    """
    bx, by, bz = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    cx, cy, cz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
    nx, ny, nz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    side, length = math.copysign(1.0, nz), math.copysign(math.sqrt(nx * nx + ny * ny + nz * nz), nz)
    if nz == 0.0:
        for k in range(3):
            best = _on_edge(p[k], p[(k + 1) % 3], x, y, radius, disc, best, touch)
        return best
    nx, ny, nz = nx / length, ny / length, nz / length
    flat = math.sqrt(nx * nx + ny * ny)
    # The place of the disc that is nearest to the facet, and the point below it.
    if flat > 0.0:
        x0, y0 = x - disc * nx / flat - p[0, 0], y - disc * ny / flat - p[0, 1]
    else:
        x0, y0 = x - p[0, 0], y - p[0, 1]
    px, py = x0 - radius * nx, y0 - radius * ny
    first = side * (bx * py - by * px)
    second = side * ((cx - bx) * (py - by) - (cy - by) * (px - bx))
    third = side * (cy * px - cx * py)
    if min(first, second, third) >= 0.0:
        height = p[0, 2] + (radius - nx * x0 - ny * y0) / nz
        best = _touch(best, height, p[0, 0] + px, p[0, 1] + py, height - radius * nz, flat, x, y, touch)
    close = _CLOSE * (bx * bx + by * by + cx * cx + cy * cy + px * px + py * py)
    if first < close:
        best = _on_edge(p[0], p[1], x, y, radius, disc, best, touch)
    if second < close:
        best = _on_edge(p[1], p[2], x, y, radius, disc, best, touch)
    if third < close:
        best = _on_edge(p[2], p[0], x, y, radius, disc, best, touch)
    return best


@kernel
def _bound(extent: Floats, x: float, y: float, radius: float, disc: float) -> float:
    """Return an upper bound of the disc's height at (x, y) on what is in a box (2, 3); −inf where it misses it."""
    dx = max(extent[0, 0] - x, 0.0, x - extent[1, 0])
    dy = max(extent[0, 1] - y, 0.0, y - extent[1, 1])
    return extent[1, 2] + _rise(math.sqrt(dx * dx + dy * dy), radius, disc)


@kernel
def _bound_of_facet(p: Floats, x: float, y: float, radius: float, disc: float) -> float:
    """Return an upper bound of the disc's height at (x, y) on a facet (3, 3), by its box; −inf if it misses it."""
    dx = max(min(p[0, 0], p[1, 0], p[2, 0]) - x, 0.0, x - max(p[0, 0], p[1, 0], p[2, 0]))
    dy = max(min(p[0, 1], p[1, 1], p[2, 1]) - y, 0.0, y - max(p[0, 1], p[1, 1], p[2, 1]))
    return max(p[0, 2], p[1, 2], p[2, 2]) + _rise(math.sqrt(dx * dx + dy * dy), radius, disc)


@kernel
def drop(
    x: float, y: float, radius: float, disc: float, least: float, first: bool, corners: Floats, starts: Ints,
    extents: Floats, nodes: Ints, bounds: Floats, touch: Floats,
) -> float:  # fmt: skip
    """Return the height of the disc of a cutter that is dropped along −z at (x, y); `least` where that is lower.

    first: any height above `least` will do. touch (4,): filled, where it is higher, with the place that holds the
    cutter, and the sine of the angle between the axis and the normal there. nodes, bounds: buffers.
    """
    leaves, best = len(starts) - 1, least
    nodes[0], bounds[0], count = 0, _bound(extents[0], x, y, radius, disc), 1
    while count > 0:
        count -= 1
        node = nodes[count]
        if bounds[count] <= best:
            continue
        leaf = node - (leaves - 1)
        if leaf < 0:
            low, high = 2 * node + 1, 2 * node + 2
            under, over = _bound(extents[low], x, y, radius, disc), _bound(extents[high], x, y, radius, disc)
            if under > over:
                low, high, under, over = high, low, over, under
            # The higher one is searched first.
            if under > best:
                nodes[count], bounds[count] = low, under
                count += 1
            if over > best:
                nodes[count], bounds[count] = high, over
                count += 1
            continue
        for f in range(starts[leaf], starts[leaf + 1]):
            if _bound_of_facet(corners[f], x, y, radius, disc) <= best:
                continue
            best = _on_facet(corners[f], x, y, radius, disc, best, touch)
        if first and best > least:
            break
    return best


@kernel
def drop_all(
    places: Floats, radius: float, disc: float, corners: Floats, starts: Ints, extents: Floats, heights: Floats,
    touches: Floats,
) -> None:  # fmt: skip
    """Fill heights (N,) of the disc of a cutter dropped along −z at places (N, 2), −inf where it meets nothing.

    touches (N, 4): as in `drop`.
    """
    nodes, bounds = np.empty(STACK, dtype=np.intp), np.empty(STACK)
    for m in range(len(places)):
        x, y = places[m, 0], places[m, 1]
        heights[m] = drop(x, y, radius, disc, -math.inf, False, corners, starts, extents, nodes, bounds, touches[m])
