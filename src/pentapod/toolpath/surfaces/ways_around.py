"""Ways around: over the edges of a drive surface's mesh, where no straight way leads from one place to another."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats
from pentapod.mesh.patch import Patch
from pentapod.toolpath.surfaces.places import Places

Pair = tuple[int, int, int]
"""Number of a line, and two of its points."""


def shortest_ways(patch: Patch, open_to: Bools, starts: Floats, ends: Floats, longest: Floats) -> list[Floats | None]:
    """Return for each pair of places (L, 3) the shortest way (n, 3) over a patch's edges, both places included.

    open_to (V,): the vertices that ways may use. longest (L,): metres. None where there is no way so short.
    """
    edges = patch.topology.edges
    edges = edges[open_to[edges].all(axis=1)]
    if not len(edges) or not len(starts):
        return [None] * len(starts)
    used, index = np.unique(edges, return_inverse=True)
    points, (a, b) = patch.vertices[used], index.reshape(edges.shape).T
    length = np.linalg.norm(points[b] - points[a], axis=1)
    graph = csr_array((length, (a, b)), shape=(len(used), len(used)))
    tree = KDTree(points)
    first, last = (np.asarray(tree.query(places)[1]) for places in (starts, ends))
    found: list[Floats | None] = []
    for start, end, here, there, most in zip(starts, ends, first, last, longest, strict=True):
        reached, before = dijkstra(graph, directed=False, indices=here, return_predecessors=True, limit=most)
        if not np.isfinite(reached[there]):
            found.append(None)
            continue
        way = [int(there)]
        while way[-1] != here:
            way.append(int(before[way[-1]]))
        found.append(np.concatenate([start[None], points[way[::-1]], end[None]]))
    return found


def drawn_taut(
    centres: Places,
    lines: list[Floats],
    spacing: float,
    chordal: float,
    closest: float,
    allowed: Callable[[list[Floats | None]], list[Floats | None]],
) -> list[Floats | None]:
    """Return ways of a cutter along lines (n, 3), with corners only where it cannot go straight.

    Between corners, which are points of the line, they are those of `Places.ways`, and proven as these are.
    allowed: returns ways, None for those that are not to be taken. None where even neighbouring points have no way.
    """
    lines = [np.concatenate([line[:1], centres.on_level(line[1:-1]), line[-1:]]) for line in lines]
    known: dict[Pair, Floats | None] = {}

    def find(pairs: list[Pair]) -> None:
        pairs = [pair for pair in pairs if pair not in known]
        if pairs:
            starts, ends = (np.stack([lines[pair[0]][pair[side]] for pair in pairs]) for side in (1, 2))
            known.update(zip(pairs, allowed(centres.ways(starts, ends, spacing, chordal, closest)), strict=True))

    corners: list[list[int]] = [[0, len(line) - 1] for line in lines]
    while open_pairs := [pair for pair in _pairs(corners) if pair not in known]:
        find(open_pairs)
        for k, first, last in open_pairs:
            if known[k, first, last] is None and corners[k]:
                middle = (first + last) // 2
                corners[k] = [] if middle == first else sorted({*corners[k], middle})
    skipped = True
    while skipped:
        skipped = False
        for odd in (0, 1):
            wider = [(k, own[m], own[m + 2]) for k, own in enumerate(corners) for m in range(odd, len(own) - 2, 2)]
            find(wider)
            for k, first, last in wider:
                middle = corners[k][corners[k].index(first) + 1]
                way = known[k, first, last]
                parts = [known[k, first, middle], known[k, middle, last]]
                if way is not None and _length(way) <= sum(_length(part) for part in parts if part is not None):
                    corners[k].remove(middle)
                    skipped = True
    return [_joined([known[pair] for pair in _pairs([own], k)]) for k, own in enumerate(corners)]


def _pairs(corners: list[list[int]], first: int = 0) -> Iterator[Pair]:
    """Yield the neighbouring corners of lines, numbered from `first` on."""
    for k, own in enumerate(corners, first):
        yield from ((k, a, b) for a, b in pairwise(own))


def _length(way: Floats) -> float:
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())


def _joined(parts: list[Floats | None]) -> Floats | None:
    """Return ways that follow each other as one; None where there is none."""
    ways = [part for part in parts if part is not None]
    return np.concatenate([*(way[:-1] for way in ways), ways[-1][-1:]]) if ways else None
