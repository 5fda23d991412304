"""Sources of fronts: segments inside facets, and distances inside facets; compiled."""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.mesh.geodesic.front_kernels import Heap, Layout, propagate, put, settle
from pentapod.mesh.geodesic.window_kernels import FACET, FAR, NARROW, NEW, NEXT, Fronts, norm, reach, roomy
from pentapod.numerics.kernels import kernel

ON_SIDE = 1e-7
"""A point whose distance from a side is below this many steps lies on it."""


@kernel
def _flat(mesh: Layout, f: int, weights: Floats) -> tuple[float, float]:
    """Return the place of a point of facet f in its plane: corner 0 at the origin, side 0 along x."""
    side = mesh.lengths[mesh.edges[f, 0]]
    return weights[1] * side + weights[2] * mesh.apex[f, 0, 0], weights[2] * mesh.apex[f, 0, 1]


@kernel
def _beside(mesh: Layout, f: int, s: int, x: float, y: float) -> tuple[float, float, float, float]:
    """Return where a point (x, y) of facet f's plane is along side s, and off it inwards; and the side's direction."""
    side, ax, ay = float(mesh.lengths[mesh.edges[f, 0]]), float(mesh.apex[f, 0, 0]), float(mesh.apex[f, 0, 1])
    if s == 0:
        return x, y, 1.0, 0.0
    px, py, qx, qy = (side, 0.0, ax, ay) if s == 1 else (ax, ay, 0.0, 0.0)
    length = max(float(mesh.lengths[mesh.edges[f, s]]), 1e-300)
    dx, dy = (qx - px) / length, (qy - py) / length
    return (x - px) * dx + (y - py) * dy, dx * (y - py) - dy * (x - px), dx, dy


@kernel
def _clip(windows: Floats, at_zero: float, rise: float) -> None:
    """Cut the new window down to where at_zero + rise · b is not negative."""
    if rise > 0.0:
        windows[NEW, 0] = max(windows[NEW, 0], -at_zero / rise)
    elif rise < 0.0:
        windows[NEW, 1] = min(windows[NEW, 1], -at_zero / rise)
    elif at_zero < 0.0:
        windows[NEW, 1] = windows[NEW, 0]


@kernel
def _point(fronts: Fronts, mesh: Layout, f: int, x: float, y: float, tx: float, ty: float, heap: Heap) -> None:
    """Send fronts from a point (x, y) in facet f, ahead of a line through it that is square to t (0: everywhere)."""
    for s in range(3):
        along, off, dx, dy = _beside(mesh, f, s, x, y)
        length = mesh.lengths[mesh.edges[f, s]]
        settle(fronts, mesh, mesh.faces[f, s], norm(along, off), True, heap)
        if off <= ON_SIDE:
            continue
        windows = fronts.windows
        windows[NEW, 0], windows[NEW, 1], windows[NEW, 2], windows[NEW, 3], windows[NEW, 4] = (
            0.0,
            length,
            along,
            off,
            0.0,
        )
        # Along the side, b − along is dx, dy; off it the point is inwards of it.
        across = off * (dy * tx - dx * ty)
        _clip(windows, across - along * (dx * tx + dy * ty), dx * tx + dy * ty)
        put(fronts, mesh, f, s, heap)


@kernel
def _slab(
    fronts: Fronts, mesh: Layout, f: int, x: float, y: float, tx: float, ty: float, span: float, heap: Heap
) -> None:
    """Send straight fronts from a segment in facet f, which begins at (x, y) along unit t and is `span` steps long."""
    for s in range(3):
        along, off, dx, dy = _beside(mesh, f, s, x, y)
        cosine, sine = dx * tx + dy * ty, dx * ty - dy * tx
        for k in range(2):
            # The normal n, in the side's frame: to the left of t, or to its right.
            nx, ny = (-sine, cosine) if k else (sine, -cosine)
            if not ny < 0.0:
                continue
            windows = fronts.windows
            windows[NEW, 0], windows[NEW, 1], windows[NEW, 4] = 0.0, mesh.lengths[mesh.edges[f, s]], -FAR
            at_zero = -(along * cosine + off * sine)
            _clip(windows, at_zero, cosine)
            _clip(windows, span - at_zero, -cosine)
            _clip(windows, -(along * nx + off * ny), nx)
            windows[NEW, 2], windows[NEW, 3] = along - FAR * nx, off - FAR * ny
            put(fronts, mesh, f, s, heap)


@kernel
def send(fronts: Fronts, mesh: Layout, facets: Ints, begins: Floats, ends: Floats, heap: Heap) -> Fronts:
    """Send fronts from segments (K,) in facets, between barycentric weights (K, 3), which may be equal."""
    other, also = np.empty(3), np.empty(3)
    for k in range(len(facets)):
        f = facets[k]
        for s in range(3):
            fronts = roomy(fronts, 64 + 8 * int(fronts.counts[mesh.edges[f, s]]))
        px, py = _flat(mesh, f, begins[k])
        qx, qy = _flat(mesh, f, ends[k])
        span = norm(qx - px, qy - py)
        tx, ty = (0.0, 0.0) if span <= NARROW else ((qx - px) / span, (qy - py) / span)
        if span > NARROW:
            _slab(fronts, mesh, f, px, py, tx, ty, span, heap)
        _point(fronts, mesh, f, px, py, -tx, -ty, heap)
        if span > NARROW:
            _point(fronts, mesh, f, qx, qy, tx, ty, heap)
        for s in range(3):
            fronts = _over(fronts, mesh, f, s, begins[k], ends[k], other, also, heap)
    return fronts


@kernel
def _over(
    fronts: Fronts, mesh: Layout, f: int, s: int, begin: Floats, end: Floats, other: Floats, also: Floats, heap: Heap
) -> Fronts:
    """Send fronts over side s of facet f from what of a segment lies on it: an end, or all."""
    e, height = mesh.edges[f, s], mesh.apex[f, s, 1]
    third = (s + 2) % 3
    on_begin, on_end = begin[third] * height <= ON_SIDE, end[third] * height <= ON_SIDE
    if not (on_begin or on_end):
        return fronts
    for n in range(mesh.first[e], mesh.first[e + 1]):
        g, r = mesh.beside[n] // 3, mesh.beside[n] % 3
        if g == f:
            continue
        swap = mesh.along[g, r] != mesh.along[f, s]
        for k in range(2):
            weights, there = (end, also) if k else (begin, other)
            there[:] = 0.0
            there[(r + 1) % 3 if swap else r] = weights[s]
            there[r if swap else (r + 1) % 3] = weights[(s + 1) % 3]
        rows = 64
        for t in range(3):
            rows += 8 * int(fronts.counts[mesh.edges[g, t]])
        fronts = roomy(fronts, rows)
        px, py = _flat(mesh, g, other)
        qx, qy = _flat(mesh, g, also)
        span = norm(qx - px, qy - py)
        if on_begin and on_end and span > NARROW:
            _slab(fronts, mesh, g, px, py, (qx - px) / span, (qy - py) / span, span, heap)
        if on_begin:
            _point(fronts, mesh, g, px, py, 0.0, 0.0, heap)
        if on_end:
            _point(fronts, mesh, g, qx, qy, 0.0, 0.0, heap)
    return fronts


@kernel
def solve(
    fronts: Fronts, mesh: Layout, facets: Ints, begins: Floats, ends: Floats, limit: float, slack: float, turn: float
) -> Fronts:
    """Propagate fronts from segments in facets over the mesh, see `send` and `propagate`."""
    heap = [(0.0, 0)]
    heap.pop()
    fronts = send(fronts, mesh, facets, begins, ends, heap)
    for v in range(len(fronts.distance)):
        # Sources at vertices send fronts all around, whatever facet they were given in.
        if fronts.distance[v] <= ON_SIDE:
            fronts.bent[v] = True
            heap.append((fronts.distance[v], len(mesh.lengths) + v))
    return propagate(fronts, mesh, heap, limit, slack, turn)


@kernel
def inside(
    fronts: Fronts, mesh: Layout, sources: tuple[Ints, Floats, Floats], facets: Ints, weights: Floats, found: Floats
) -> None:
    """Write the distances (N,) of points of facets (N,) at barycentric weights (N, 3), steps.

    sources: first segment of each facet (F + 1,), and where the segments, in the order of facets, begin and end.
    """
    first, begins, ends = sources
    for k in range(len(facets)):
        f = facets[k]
        x, y = _flat(mesh, f, weights[k])
        best = math.inf
        for n in range(first[f], first[f + 1]):
            px, py = _flat(mesh, f, begins[n])
            qx, qy = _flat(mesh, f, ends[n])
            square = (qx - px) ** 2 + (qy - py) ** 2
            share = ((x - px) * (qx - px) + (y - py) * (qy - py)) / square if square > 0.0 else 0.0
            share = min(max(share, 0.0), 1.0)
            best = min(best, norm(px + share * (qx - px) - x, py + share * (qy - py) - y))
        for s in range(3):
            along, off, _, _ = _beside(mesh, f, s, x, y)
            off = max(off, 0.0)
            best = min(best, fronts.distance[mesh.faces[f, s]] + norm(along, off))
            e = mesh.edges[f, s]
            if not mesh.along[f, s]:
                along = float(mesh.lengths[e]) - along
            row = int(fronts.heads[e])
            while row >= 0:
                if fronts.links[row, FACET] != f:
                    sx, sy = float(fronts.windows[row, 2]), float(fronts.windows[row, 3])
                    at = sx + (along - sx) * sy / (sy + off) if sy + off > 0.0 else along
                    at = min(max(at, float(fronts.windows[row, 0])), float(fronts.windows[row, 1]))
                    best = min(best, reach(fronts.windows, row, at) + norm(along - at, off))
                row = int(fronts.links[row, NEXT])
        found[k] = best
