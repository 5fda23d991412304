"""Fast marching of a front over triangles, compiled."""

from __future__ import annotations

import heapq

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.kernels import kernel


@kernel
def march(faces: Ints, sides: Floats, first: Ints, around: Ints, distance: Floats) -> None:
    """Lower distance (V,) in place from its finite entries on, over facets (F, 3) with sides (F, 3) as travelled.

    Side s runs from corner s to corner s + 1. around[first[v] : first[v + 1]] are the facets at vertex v. Vertices
    are settled in the order of their distance. A facet with two settled corners proposes for its third the straight
    front through both where that front arrives from between them, otherwise the distance along a side.
    """
    settled = np.zeros(len(distance), dtype=np.bool_)
    heap = [(0.0, 0)]
    heap.pop()
    for v in range(len(distance)):
        if distance[v] < np.inf:
            heap.append((distance[v], v))
    heapq.heapify(heap)
    while len(heap) > 0:
        d, v = heapq.heappop(heap)
        if settled[v] or d > distance[v]:
            continue
        settled[v] = True
        for n in range(first[v], first[v + 1]):
            f = around[n]
            k = 0
            while faces[f, k] != v:
                k += 1
            for turn in range(2):
                # v is settled, `other` may be, `free` is the corner whose distance is proposed.
                i = (k + 1 + turn) % 3
                j = (k + 2 - turn) % 3
                free, other = faces[f, i], faces[f, j]
                if settled[free]:
                    continue
                to_free = sides[f, k] if i == (k + 1) % 3 else sides[f, i]
                proposal = distance[v] + to_free
                if settled[other]:
                    base = sides[f, k] if j == (k + 1) % 3 else sides[f, j]
                    across = sides[f, i] if j == (i + 1) % 3 else sides[f, j]
                    slope = (distance[other] - distance[v]) / base
                    if abs(slope) < 1.0:
                        x = 0.5 * (base + (to_free * to_free - across * across) / base)
                        y = np.sqrt(max(to_free * to_free - x * x, 0.0))
                        rise = np.sqrt(1.0 - slope * slope)
                        foot = x - y * slope / rise
                        if foot >= 0.0 and foot <= base:
                            proposal = min(proposal, distance[v] + slope * x + rise * y)
                if proposal < distance[free]:
                    distance[free] = proposal
                    heapq.heappush(heap, (proposal, free))
