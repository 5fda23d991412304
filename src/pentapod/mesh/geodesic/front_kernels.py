"""Propagation of windows over a mesh: out of sources, over facets, around vertices; and distances inside facets.

An edge is propagated as soon as the fronts have passed what they reach of it so far, in the order of these distances.
Vertices at which shortest ways can turn are sources of their own. What is propagated too early is corrected later.
"""

from __future__ import annotations

import heapq
import math
from typing import NamedTuple

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.mesh.geodesic.window_kernels import (
    DONE,
    FACET,
    NARROW,
    NEW,
    NEXT,
    TIE,
    Fronts,
    insert,
    merge,
    norm,
    reach,
    roomy,
    slope,
)
from pentapod.numerics.kernels import kernel

Heap = list[tuple[float, int]]


class Layout(NamedTuple):
    """Facets laid flat. Side s of a facet runs from corner s to corner s + 1; lengths are in steps.

    faces, edges (F, 3): vertices of the corners, edges of the sides. along (F, 3): whether a side runs in the sense of
    its edge. lengths (E,). apex (F, 3, 2): place of the third corner, along a side and off it. beside (3 F,), first
    (E + 1,): the sides 3 f + s at each edge. around (3 F,), start (V + 1,): the corners 3 f + k at each vertex.
    turning (V,): where shortest ways can turn: borders, and where the facets' angles exceed a full turn.
    narrowest (E,): least height of the facets at each edge.
    """

    faces: Ints
    edges: Ints
    along: Bools
    lengths: Floats
    apex: Floats
    beside: Ints
    first: Ints
    around: Ints
    start: Ints
    turning: Bools
    narrowest: Floats


@kernel
def _cast(low: float, high: float, x: float, y: float, cx: float, cy: float, side: float, out: Floats) -> None:
    """Write what is seen on a side from the origin to (cx, −cy) through low to high on the x axis: b0, b1, x, y.

    x, y: the virtual source. side: the length of that side; its places are measured from the origin.
    """
    out[2], out[3] = (x * cx - y * cy) / side, (cx * y + cy * x) / side
    for k in range(2):
        at = high if k else low
        share = cx * y - cy * (at - x)
        out[k] = min(max(side * at * y / share, 0.0), side) if share > 0.0 else (side if at > 0.0 else 0.0)


@kernel
def put(fronts: Fronts, mesh: Layout, f: int, s: int, heap: Heap) -> None:
    """Insert the new window, measured along side s of facet f, into that side's edge, and queue the edge."""
    windows, e = fronts.windows, mesh.edges[f, s]
    if not mesh.along[f, s]:
        windows[NEW, 0], windows[NEW, 1] = mesh.lengths[e] - windows[NEW, 1], mesh.lengths[e] - windows[NEW, 0]
        windows[NEW, 2] = mesh.lengths[e] - windows[NEW, 2]
    # The edge waits until the front has passed it as a whole: windows that arrive by then may be merged.
    key = max(reach(windows, NEW, 0.0), reach(windows, NEW, float(mesh.lengths[e])))
    if insert(fronts, e, f) and key < fronts.keys[e]:
        fronts.keys[e] = key
        heapq.heappush(heap, (key, e))


@kernel
def settle(fronts: Fronts, mesh: Layout, v: int, distance: float, straight: bool, heap: Heap) -> None:
    """Lower the distance of a vertex, reached by a straight way or by one that turns; queue it if it is a source."""
    if straight and distance <= fronts.distance[v] + TIE:
        fronts.bent[v] = False
    if distance < fronts.distance[v]:
        fronts.bent[v] = fronts.bent[v] or not (straight or fronts.distance[v] < distance + TIE)
        fronts.distance[v] = distance
        if mesh.turning[v] or fronts.bent[v]:
            heapq.heappush(heap, (distance, len(mesh.lengths) + v))


@kernel
def _shared(x: float, other: Floats, own: Floats, cx: float, cy: float, length: float) -> float:
    """Return where the own ray crosses a side that ends where a neighbour's ray through x ends.

    other, own (2,): their virtual sources.
    """
    if x <= other[0] + (cx - other[0]) * other[1] / (other[1] + cy):
        share = x * other[1] / max(cx * other[1] - cy * (x - other[0]), 1e-300)
        along = share * cx
    else:
        x, ox, dx = length - x, length - other[0], length - cx
        share = x * other[1] / max(dx * other[1] - cy * (x - ox), 1e-300)
        along = length - share * dx
    return own[0] + (along - own[0]) * own[1] / (own[1] + share * cy)


@kernel
def _widened(fronts: Fronts, row: int, beside: int, high: bool, mesh: Layout, g: int, s: int, turn: float) -> float:
    """Return up to where a window goes, measured along side s of facet g, so that there is no gap to its neighbour.

    Merging turns rays a little; those of neighbours that touch must not part. high: the end with the higher place.
    turn: largest angle by which they part so. At a vertex the neighbour is on another edge, and may be so far off.
    """
    windows, along = fronts.windows, mesh.along[g, s]
    length, cx, cy = float(mesh.lengths[mesh.edges[g, s]]), float(mesh.apex[g, s, 0]), float(mesh.apex[g, s, 1])
    end = float(windows[row, 1 if high else 0])
    place = end if along else length - end
    own, other = fronts.own, fronts.other
    own[0], own[1] = windows[row, 2] if along else length - windows[row, 2], windows[row, 3]
    if abs(end - (length if high else 0.0)) <= NARROW:
        angle = turn if high == along else -turn
        x, y = own[0] - place, own[1]
        other[0], other[1] = place + x - angle * y, y + angle * x
    elif beside < 0 or fronts.links[beside, FACET] != fronts.links[row, FACET]:
        return place
    else:
        part = slope(windows, beside, end) - slope(windows, row, end)
        if abs(windows[beside, 0 if high else 1] - end) > NARROW or not 1e-12 < (part if high else -part) < turn:
            return place
        other[0], other[1] = windows[beside, 2] if along else length - windows[beside, 2], windows[beside, 3]
    if other[1] <= 0.0:
        return place
    return _shared(place, other, own, cx, cy, length)


@kernel
def _cross(fronts: Fronts, mesh: Layout, row: int, before: int, g: int, s: int, turn: float, heap: Heap) -> None:
    """Propagate a window through facet g, which it enters by side s. before: the window before it, or −1."""
    windows, out = fronts.windows, fronts.out
    b0, b1, x, y, start = windows[row, 0], windows[row, 1], windows[row, 2], windows[row, 3], windows[row, 4]
    b, c = (s + 1) % 3, (s + 2) % 3
    length, cx, cy = float(mesh.lengths[mesh.edges[g, s]]), float(mesh.apex[g, s, 0]), float(mesh.apex[g, s, 1])
    if not y > 0.0:
        return
    low = _widened(fronts, row, before, False, mesh, g, s, turn)
    high = _widened(fronts, row, fronts.links[row, NEXT], True, mesh, g, s, turn)
    if not mesh.along[g, s]:
        b0, b1, x, low, high = length - b1, length - b0, length - x, high, low
    middle = x + (cx - x) * y / (y + cy)
    at = min(max(middle, b0), b1)
    distance = start + norm(at - x, y) + norm(cx - at, cy)
    settle(fronts, mesh, mesh.faces[g, c], distance, abs(at - middle) <= NARROW, heap)
    for k in range(2):
        side = float(mesh.lengths[mesh.edges[g, b if k else c]])
        if side <= NARROW:
            continue
        if k == 0 and low < middle:
            _cast(low, min(high, middle), x, y, cx, cy, side, out)
            windows[NEW, 0], windows[NEW, 1], windows[NEW, 2] = side - out[1], side - out[0], side - out[2]
        elif k == 1 and high > middle:
            _cast(length - high, length - max(low, middle), length - x, y, length - cx, cy, side, out)
            windows[NEW, 0], windows[NEW, 1], windows[NEW, 2] = out[0], out[1], out[2]
        else:
            continue
        windows[NEW, 3], windows[NEW, 4] = out[3], start
        if out[3] > 0.0:
            put(fronts, mesh, g, b if k else c, heap)


@kernel
def _around(fronts: Fronts, mesh: Layout, v: int, heap: Heap) -> None:
    """Propagate from a vertex to the edges opposite, and along the edges at it."""
    for n in range(mesh.start[v], mesh.start[v + 1]):
        f, k = mesh.around[n] // 3, mesh.around[n] % 3
        s = (k + 1) % 3
        for other in range(2):
            side = mesh.lengths[mesh.edges[f, k if other else (k + 2) % 3]]
            settle(fronts, mesh, int(mesh.faces[f, s if other else (k + 2) % 3]), fronts.distance[v] + side, True, heap)
        windows = fronts.windows
        windows[NEW, 0], windows[NEW, 1], windows[NEW, 4] = 0.0, mesh.lengths[mesh.edges[f, s]], fronts.distance[v]
        windows[NEW, 2], windows[NEW, 3] = mesh.apex[f, s, 0], mesh.apex[f, s, 1]
        if windows[NEW, 3] > 0.0:
            put(fronts, mesh, f, s, heap)


@kernel
def propagate(fronts: Fronts, mesh: Layout, heap: Heap, limit: float, slack: float, turn: float) -> Fronts:
    """Propagate all that is queued within `limit` steps; windows are merged where that changes few distances.

    slack: largest change for each step of way over the next facet. turn: largest change of direction, radians.
    """
    heapq.heapify(heap)
    while len(heap) > 0:
        key, item = heapq.heappop(heap)
        if key > limit:
            break
        if item >= len(mesh.lengths):
            v = item - len(mesh.lengths)
            if key == fronts.distance[v] and (mesh.turning[v] or fronts.bent[v]):
                rows = 8
                for n in range(mesh.start[v], mesh.start[v + 1]):
                    f, k = mesh.around[n] // 3, mesh.around[n] % 3
                    rows += 4 + int(fronts.counts[mesh.edges[f, (k + 1) % 3]])
                fronts = roomy(fronts, rows)
                _around(fronts, mesh, v, heap)
            continue
        if key != fronts.keys[item]:
            continue
        fronts.keys[item] = math.inf
        merge(fronts, item, slack * mesh.narrowest[item], turn)
        row, before = fronts.heads[item], -1
        while row >= 0:
            if fronts.links[row, DONE] == 0:
                fronts.links[row, DONE] = 1
                for n in range(mesh.first[item], mesh.first[item + 1]):
                    g, s = mesh.beside[n] // 3, mesh.beside[n] % 3
                    if g != fronts.links[row, FACET]:
                        p, q = mesh.edges[g, (s + 1) % 3], mesh.edges[g, (s + 2) % 3]
                        fronts = roomy(fronts, 8 + 2 * int(fronts.counts[p] + fronts.counts[q]))
                        _cross(fronts, mesh, row, before, g, s, 4.0 * turn, heap)
            before, row = row, fronts.links[row, NEXT]
    return fronts
