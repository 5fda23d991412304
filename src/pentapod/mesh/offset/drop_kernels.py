"""Height at which a ball that is dropped comes to rest on a mesh, by branch and bound through the tree of boxes.

The ball rests on a facet, an edge or a vertex. Above an edge the ball's section is a circle, smaller the further the
edge is from the middle; it is lowered onto a line.
"""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.mesh.query.segment_kernels import STACK
from pentapod.numerics.kernels import kernel


@kernel
def _on_facet(p: Floats, x: float, y: float, radius: float) -> float:
    """Return the height of a ball's centre at (x, y) that rests on the inside of a facet (3, 3); −inf if it cannot."""
    bx, by, bz = p[1, 0] - p[0, 0], p[1, 1] - p[0, 1], p[1, 2] - p[0, 2]
    cx, cy, cz = p[2, 0] - p[0, 0], p[2, 1] - p[0, 1], p[2, 2] - p[0, 2]
    nx, ny, nz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    length = math.copysign(math.sqrt(nx * nx + ny * ny + nz * nz), nz)
    if nz == 0.0:
        return -math.inf
    nx, ny, nz = nx / length, ny / length, nz / length
    px, py = x - radius * nx - p[0, 0], y - radius * ny - p[0, 1]
    first = bx * py - by * px
    second = (cx - bx) * (py - by) - (cy - by) * (px - bx)
    third = cy * px - cx * py
    if min(first, second, third) < 0.0 < max(first, second, third):
        return -math.inf
    return p[0, 2] + (radius - nx * (x - p[0, 0]) - ny * (y - p[0, 1])) / nz


@kernel
def _on_edge(a: Floats, b: Floats, x: float, y: float, radius: float) -> float:
    """Return the centre's height of a ball at (x, y) that touches an edge, or its end a (3,); −inf where it cannot."""
    wx, wy, dx, dy = x - a[0], y - a[1], b[0] - a[0], b[1] - a[1]
    below = radius * radius - wx * wx - wy * wy
    best = a[2] + math.sqrt(below) if below >= 0.0 else -math.inf
    length = math.sqrt(dx * dx + dy * dy)
    if length > 0.0:
        dx, dy = dx / length, dy / length
        aside = wx * dy - wy * dx
        below = radius * radius - aside * aside
        if below > 0.0:
            section, slope = math.sqrt(below), (b[2] - a[2]) / length
            along, steep = wx * dx + wy * dy, math.sqrt(1.0 + slope * slope)
            touch = along + section * slope / steep
            if 0.0 <= touch <= length:
                best = max(best, a[2] + slope * along + section * steep)
    return best


@kernel
def _bound(extent: Floats, x: float, y: float, radius: float) -> float:
    """Return an upper bound of the height of a ball at (x, y) on what is in a box (2, 3); −inf where it misses it."""
    dx = max(extent[0, 0] - x, 0.0, x - extent[1, 0])
    dy = max(extent[0, 1] - y, 0.0, y - extent[1, 1])
    below = radius * radius - dx * dx - dy * dy
    return extent[1, 2] + math.sqrt(below) if below >= 0.0 else -math.inf


@kernel
def drop_all(places: Floats, radius: float, corners: Floats, starts: Ints, extents: Floats, heights: Floats) -> None:
    """Fill heights (N,) of the centre of a ball dropped along −z at places (N, 2); −inf where it meets nothing."""
    nodes, bounds, leaves = np.empty(STACK, dtype=np.intp), np.empty(STACK), len(starts) - 1
    for m in range(len(places)):
        x, y, best = places[m, 0], places[m, 1], -math.inf
        nodes[0], bounds[0], count = 0, _bound(extents[0], x, y, radius), 1
        while count > 0:
            count -= 1
            node = nodes[count]
            if bounds[count] <= best:
                continue
            leaf = node - (leaves - 1)
            if leaf < 0:
                low, high = 2 * node + 1, 2 * node + 2
                least, most = _bound(extents[low], x, y, radius), _bound(extents[high], x, y, radius)
                if least > most:
                    low, high, least, most = high, low, most, least
                # The higher one is searched first.
                if least > best:
                    nodes[count], bounds[count] = low, least
                    count += 1
                if most > best:
                    nodes[count], bounds[count] = high, most
                    count += 1
                continue
            for f in range(starts[leaf], starts[leaf + 1]):
                if _bound_of_facet(corners[f], x, y, radius) <= best:
                    continue
                best = max(best, _on_facet(corners[f], x, y, radius))
                for k in range(3):
                    best = max(best, _on_edge(corners[f, k], corners[f, (k + 1) % 3], x, y, radius))
        heights[m] = best


@kernel
def _bound_of_facet(p: Floats, x: float, y: float, radius: float) -> float:
    """Return an upper bound of the height of a ball at (x, y) on a facet (3, 3), by its box; −inf if it misses it."""
    dx = max(min(p[0, 0], p[1, 0], p[2, 0]) - x, 0.0, x - max(p[0, 0], p[1, 0], p[2, 0]))
    dy = max(min(p[0, 1], p[1, 1], p[2, 1]) - y, 0.0, y - max(p[0, 1], p[1, 1], p[2, 1]))
    below = radius * radius - dx * dx - dy * dy
    return max(p[0, 2], p[1, 2], p[2, 2]) + math.sqrt(below) if below >= 0.0 else -math.inf
