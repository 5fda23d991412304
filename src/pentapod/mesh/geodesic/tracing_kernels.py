"""Rays over the facets of a mesh, compiled."""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.numerics.kernels import kernel


@kernel
def _rates(vertices: Floats, face: Ints, normal: Floats, d: Floats, rate: Floats) -> None:
    """Write the change per metre of barycentric weights (3,) along d (3,) in a facet's plane; normal (3,): scratch."""
    a, b, c = vertices[face[0]], vertices[face[1]], vertices[face[2]]
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    normal[0], normal[1], normal[2] = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    square = max(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2], 1e-300)
    # Each weight grows away from the opposite side.
    for k in range(3):
        p, q = vertices[face[(k + 1) % 3]], vertices[face[(k + 2) % 3]]
        sx, sy, sz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        gx = (normal[1] * sz - normal[2] * sy) / square
        gy = (normal[2] * sx - normal[0] * sz) / square
        gz = (normal[0] * sy - normal[1] * sx) / square
        rate[k] = gx * d[0] + gy * d[1] + gz * d[2]


@kernel
def _turned(vertices: Floats, first: int, second: int, before: Floats, after: Floats, d: Floats) -> None:
    """Turn d (3,) in place about the edge from `first` to `second`, from a facet's plane into its neighbour's.

    before, after (3,): the unit normals of both.
    """
    p, q = vertices[first], vertices[second]
    ax, ay, az = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    length = max(math.sqrt(ax * ax + ay * ay + az * az), 1e-300)
    ax, ay, az = ax / length, ay / length, az / length
    # Across the edge: out of the one facet and into the other.
    ox, oy, oz = ay * before[2] - az * before[1], az * before[0] - ax * before[2], ax * before[1] - ay * before[0]
    ix, iy, iz = ay * after[2] - az * after[1], az * after[0] - ax * after[2], ax * after[1] - ay * after[0]
    along = d[0] * ax + d[1] * ay + d[2] * az
    across = d[0] * ox + d[1] * oy + d[2] * oz
    x, y, z = along * ax + across * ix, along * ay + across * iy, along * az + across * iz
    length = max(math.sqrt(x * x + y * y + z * z), 1e-300)
    d[0], d[1], d[2] = x / length, y / length, z / length


@kernel
def _exit(w: Floats, rate: Floats, entered: int, slowest: float) -> tuple[int, float]:
    """Return the side by which a ray at weights w (3,) leaves a facet, not `entered`, and after how many metres.

    Side s lies opposite corner s + 2, whose weight is zero there.
    """
    side, until = 0, math.inf
    for s in range(3):
        fall = rate[(s + 2) % 3]
        if s != entered and fall < -slowest:
            time = -w[(s + 2) % 3] / fall
            if time < until:
                side, until = s, time
    return side, max(until, 0.0)


@kernel
def trace(
    vertices: Floats,
    faces: Ints,
    facet_normals: Floats,
    adjacent: Ints,
    lengths: Floats,
    slowest: float,
    facets: Ints,
    weights: Floats,
    directions: Floats,
    landed: Bools,
) -> None:
    """Move rays by lengths (N,) in place: facets (N,), weights (N, 3) in them, directions (N, 3), landed (N,).

    adjacent (F, 3): the facet over each side, −1 at borders. slowest: rate per metre below which a weight is constant.
    """
    rate, normal, w, d = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for k in range(len(facets)):
        left, entered = lengths[k] if landed[k] else 0.0, -1
        f = facets[k]
        for s in range(3):
            w[s], d[s] = weights[k, s], directions[k, s]
        # A ray of finite length ends; the bound is for rounding on facets without extent.
        for _ in range(20 * len(faces)):
            if not left > 0.0:
                break
            _rates(vertices, faces[f], normal, d, rate)
            side, until = _exit(w, rate, entered, slowest)
            advance = min(left, until)
            for s in range(3):
                w[s] = max(w[s] + advance * rate[s], 0.0)
            total = w[0] + w[1] + w[2]
            for s in range(3):
                w[s] /= total
            if left <= until:
                break
            left -= advance
            after = adjacent[f, side]
            if after < 0:
                landed[k] = False
                break
            first, second = faces[f, side], faces[f, (side + 1) % 3]
            _turned(vertices, first, second, facet_normals[f], facet_normals[after], d)
            # The neighbour runs along the edge the other way: its side from `second` to `first`.
            entered = 0
            while faces[after, entered] != second or faces[after, (entered + 1) % 3] != first:
                entered += 1
            share_first, share_second = w[side], w[(side + 1) % 3]
            total = share_second + share_first
            w[entered], w[(entered + 1) % 3], w[(entered + 2) % 3] = share_second / total, share_first / total, 0.0
            f = after
        facets[k] = f
        for s in range(3):
            weights[k, s], directions[k, s] = w[s], d[s]
