"""Mesh topology: edges of a triangle mesh, neighbouring facets, borders and connected components."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from pentapod.base.arrays import Bools, Floats, Ints


def components(count: int, a: Ints, b: Ints) -> tuple[int, Ints]:
    """Return the number of connected components, and each node's label, of `count` nodes with links a–b."""
    # Half the memory of 64 bits: five million facets have fifteen million sides.
    index = np.int32 if count < 2**31 else np.int64
    links = coo_array((np.ones(len(a), dtype=np.int8), (a.astype(index), b.astype(index))), shape=(count, count))
    number, labels = connected_components(links, directed=False)
    return int(number), labels.astype(np.intp)


@dataclass(frozen=True, eq=False)
class Topology:
    """The edges of the facets `faces` (F, 3), vertex indices, of a mesh with `vertex_count` vertices."""

    faces: Ints
    vertex_count: int

    @cached_property
    def _sorted(self) -> tuple[Ints, Ints]:
        """Facet sides (3F,) ordered by their edge, and where each edge (E,) begins in that order."""
        a, b = self.faces, np.roll(self.faces, -1, axis=1)
        key = (np.minimum(a, b) * np.intp(self.vertex_count) + np.maximum(a, b)).ravel()
        order = np.argsort(key, kind="stable")
        ordered = key[order]
        first = np.concatenate([[True], ordered[1:] != ordered[:-1]])[: len(ordered)]
        return order, np.flatnonzero(first)

    @cached_property
    def edges(self) -> Ints:
        """Vertices (E, 2) of the edges, the lower index first."""
        order, starts = self._sorted
        side = order[starts]
        ends = np.stack([self.faces.ravel()[side], self.faces.ravel()[side - side % 3 + (side + 1) % 3]], axis=1)
        return np.sort(ends, axis=1)

    @cached_property
    def edge_of_side(self) -> Ints:
        """Edge (F, 3) of each facet's side; side s runs from corner s to corner s + 1."""
        order, starts = self._sorted
        edge = np.empty(len(order), dtype=np.intp)
        edge[order] = np.repeat(np.arange(len(starts)), self.facets_at_edge)
        return edge.reshape(-1, 3)

    @cached_property
    def facets_at_edge(self) -> Ints:
        """Number (E,) of facets that meet at each edge: 1 on a border, 2 inside, more where not manifold."""
        order, starts = self._sorted
        return np.diff(starts, append=len(order))

    @cached_property
    def side_pairs(self) -> tuple[Ints, Ints]:
        """Sides (M,), (M,) as flat indices 3 f + s, that meet at each edge of exactly two facets."""
        order, starts = self._sorted
        first = starts[self.facets_at_edge == 2]
        return order[first], order[first + 1]

    @cached_property
    def pair_edges(self) -> Ints:
        """Edge (M,) of each pair of `side_pairs`."""
        return np.flatnonzero(self.facets_at_edge == 2)

    @cached_property
    def pair_agrees(self) -> Bools:
        """Whether (M,) the facets of each pair run along their edge in opposite senses, as they should."""
        start = self.faces.ravel()
        a, b = self.side_pairs
        return start[a] != start[b]

    @cached_property
    def bodies(self) -> tuple[int, Ints]:
        """Number of bodies, and the body (F,) of each facet; facets that share an edge belong together."""
        order, starts = self._sorted
        same = np.ones(len(order), dtype=np.bool_)
        same[starts] = False
        later = np.flatnonzero(same)
        return components(len(self.faces), order[later] // 3, order[later - 1] // 3)

    def small_bodies(self, points: Floats, least: float) -> Bools:
        """Return the facets (F,) of bodies with an extent, the diagonal of their bounding box, below `least`.

        points (V, 3): the vertices.
        """
        count, body = self.bodies
        low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
        corners, owner = points[self.faces].reshape(-1, 3), np.repeat(body, 3)
        np.minimum.at(low, owner, corners)
        np.maximum.at(high, owner, corners)
        return np.asarray((np.linalg.norm(high - low, axis=1) < least)[body])

    @property
    def watertight(self) -> bool:
        """Whether every edge belongs to exactly two facets."""
        return bool((self.facets_at_edge == 2).all())

    @property
    def consistent(self) -> bool:
        """Whether all facets that share an edge with one other facet are wound alike."""
        return bool(self.pair_agrees.all())

    @cached_property
    def border_loops(self) -> int:
        """Number of connected pieces of border; loops that touch in a vertex count as one."""
        border = self.edges[self.facets_at_edge == 1]
        if not len(border):
            return 0
        vertices, ends = np.unique(border.ravel(), return_inverse=True)
        ends = ends.reshape(-1, 2)
        return components(len(vertices), ends[:, 0], ends[:, 1])[0]

    def consistent_winding(self, areas: Floats) -> tuple[Bools, bool]:
        """Return which facets (F,) to turn so that each body is wound alike, and whether that is possible for all.

        Two-colouring by the connected components of the double cover: each facet is a node as it is and a node turned,
        and neighbours that agree link nodes of the same kind. The part of a body with the smaller area is turned. A
        one-sided surface (a Möbius strip) cannot be wound consistently; its facets are left unchanged.
        """
        count = len(self.faces)
        a, b = (side // 3 for side in self.side_pairs)
        cross = np.where(self.pair_agrees, 0, count)
        _, labels = components(
            2 * count, np.concatenate([a, a + count]), np.concatenate([b + cross, b + count - cross])
        )
        kept, turned = labels[:count], labels[count:]
        one_sided = kept == turned
        _, body = np.unique(np.minimum(kept, turned), return_inverse=True)
        second = kept > turned
        share = np.bincount(body, weights=np.where(second, areas, -areas))
        flip = np.where(share[body] > 0.0, ~second, second)
        return flip & ~one_sided, not bool(one_sided.any())
