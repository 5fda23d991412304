"""Manifold dual contouring: the surface between nodes inside and outside on a sparse regular grid.

Dual contouring (Ju, Losasso, Schaefer, Warren 2002) puts one vertex into each cell that the surface passes: the
minimum of the quadric of the points and normals at which it crosses the cell's edges, so that creases and corners come
out sharp. Where several sheets pass one cell each gets a vertex of its own (Nielson 2004; Schaefer, Ju, Warren 2007).
Each crossed edge gives two triangles between the vertices of the four cells about it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints

_CORNERS = np.array([[(corner >> axis) & 1 for axis in range(3)] for corner in range(8)])
"""The corners (8, 3) of a cell; bit k of a corner's number tells its place along axis k."""
_EDGES = np.array([(corner, corner | 1 << axis) for axis in range(3) for corner in range(8) if not corner >> axis & 1])
"""The edges (12, 2) of a cell: four along x, four along y, four along z."""
_FLAT = 0.05
"""Eigenvalues of the quadric below this share of the largest count as 0: the surface is flat in that direction."""


@dataclass(frozen=True, eq=False)
class Grid:
    """A regular grid: node (i, j, k) at low + step · (i, j, k); shape (3,) nodes. Keys number the nodes in C order."""

    low: Floats
    step: float
    shape: Ints

    @property
    def strides(self) -> Ints:
        """By how much the key grows (3,) from a node to the next one along each axis."""
        return np.array([self.shape[1] * self.shape[2], self.shape[2], 1], dtype=np.intp)

    def keys(self, nodes: Ints) -> Ints:
        """Return the keys (...) of nodes (..., 3)."""
        return nodes @ self.strides

    def nodes(self, keys: Ints) -> Ints:
        """Return the nodes (..., 3) of keys (...)."""
        return np.stack(np.unravel_index(keys, tuple(self.shape)), axis=-1)

    def points(self, keys: Ints) -> Floats:
        """Return where nodes are, (..., 3) metres."""
        return self.low + self.step * self.nodes(keys)


@dataclass(frozen=True, eq=False)
class Crossings:
    """Where the surface crosses edges of the grid, one a row.

    keys (E,): of the edges' lower nodes. axes (E,): along which the edges run. outward (E,): whether the lower node is
    outside. points (E, 3), normals (E, 3): of the surface there, metres and unit, normals outwards.
    """

    keys: Ints
    axes: Ints
    outward: Bools
    points: Floats
    normals: Floats


def dual_contour(grid: Grid, keys: Ints, outside: Bools, crossings: Crossings) -> tuple[Floats, Ints, Bools]:
    """Return vertices (V, 3), triangles (T, 3), facing outwards, and which vertices (V,) lie on a crease or corner.

    keys (N,): ascending, of the nodes that are known, among them all corners of the cells about crossings. outside
    (N,): their states. No vertex lies outside its cell.
    """
    strides = grid.strides
    across = np.stack([(crossings.axes + 1) % 3, (crossings.axes + 2) % 3], axis=1)
    # The four cells about an edge, in order about it, and the number of the edge within each.
    around = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    cell_keys = crossings.keys[:, None] - strides[across] @ around.T
    corner = (1 << across[:, :1]) * around[:, 0] + (1 << across[:, 1:]) * around[:, 1]
    edge = _edge_numbers()[crossings.axes[:, None], corner]
    cells, cell = np.unique(cell_keys, return_inverse=True)
    cell = cell.reshape(-1, 4)
    corners = np.searchsorted(keys, cells[:, None] + _CORNERS @ strides)
    pattern = outside[corners] @ (1 << np.arange(8))
    sheet = _sheets()[pattern[cell], edge]
    vertices, vertex = np.unique(4 * cell + sheet, return_inverse=True)
    vertex = vertex.reshape(-1, 4)
    points, sharp = _quadric_minima(crossings, vertex, len(vertices), grid.points(cells[vertices // 4]), grid.step)
    quads = np.where(crossings.outward[:, None], vertex[:, ::-1], vertex)
    return points, _triangles(points, quads, sharp), sharp


@cache
def _edge_numbers() -> Ints:
    """Return the number (3, 8) of the edge along an axis that begins at a corner."""
    numbers = np.full((3, 8), -1, dtype=np.intp)
    for number, (first, second) in enumerate(_EDGES.tolist()):
        numbers[(second - first).bit_length() - 1, first] = number
    return numbers


@cache
def _sheets() -> Ints:
    """Return for each pattern (256) of corners outside which sheet of the surface crosses each edge (12); −1: none.

    On a face with two corners outside, one opposite the other, the sheets cut off those two corners: nodes outside are
    neighbours along edges only.
    """
    numbers = _edge_numbers()
    sheets = np.full((256, 12), -1, dtype=np.intp)
    for pattern in range(256):
        out = [bool(pattern >> corner & 1) for corner in range(8)]
        crossed = [e for e, (a, b) in enumerate(_EDGES.tolist()) if out[a] != out[b]]
        parent = {e: e for e in crossed}

        def root(e: int, parent: dict[int, int] = parent) -> int:
            return e if parent[e] == e else root(parent[e])

        for axis in range(3):
            u, v = 1 << (axis + 1) % 3, 1 << (axis + 2) % 3
            for base in (0, 1 << axis):
                loop = [base, base | u, base | u | v, base | v]
                sides = [
                    int(numbers[(a ^ b).bit_length() - 1, min(a, b)])
                    for a, b in zip(loop, [*loop[1:], loop[0]], strict=True)
                ]
                on = [k for k in range(4) if sides[k] in parent]
                if len(on) == 2:
                    pairs = [(sides[on[0]], sides[on[1]])]
                else:  # none, or all four: sides k − 1 and k meet in corner k of the loop
                    pairs = [(sides[k - 1], sides[k]) for k in range(4) if len(on) == 4 and out[loop[k]]]
                for a, b in pairs:
                    parent[root(a)] = root(b)
        roots = sorted({root(e) for e in crossed})
        for e in crossed:
            sheets[pattern, e] = roots.index(root(e))
    return sheets


def _quadric_minima(crossings: Crossings, vertex: Ints, count: int, low: Floats, step: float) -> tuple[Floats, Bools]:
    """Return for each vertex (V, 3) the point nearest to all its tangent planes, and whether (V,) they form a crease.

    vertex (E, 4): the vertices about each crossing. low (V, 3): the lower corners of their cells.
    """
    owner, row = vertex.ravel(), np.repeat(np.arange(len(vertex)), 4)

    def total(values: Floats) -> Floats:
        return np.bincount(owner, weights=values[row], minlength=count).astype(np.float64)

    number = np.bincount(owner, minlength=count)[:, None]
    n, middle = crossings.normals, np.stack([total(crossings.points[:, k]) for k in range(3)], axis=1) / number
    offsets = (n * crossings.points).sum(axis=1)
    quadric = np.empty((count, 3, 3))
    for i in range(3):
        for j in range(i + 1):
            quadric[:, i, j] = quadric[:, j, i] = total(n[:, i] * n[:, j])
    right = np.stack([total(n[:, k] * offsets) for k in range(3)], axis=1)
    right -= np.einsum("vij,vj->vi", quadric, middle)
    values, ways = np.linalg.eigh(quadric)
    counts = values > _FLAT * values[:, -1:]
    inverse = np.where(counts, 1.0 / np.where(counts, values, 1.0), 0.0)
    points = middle + np.einsum("vij,vj->vi", ways, inverse * np.einsum("vji,vj->vi", ways, right))
    return np.clip(points, low, low + step), counts[:, 1]


def _triangles(points: Floats, quads: Ints, sharp: Bools) -> Ints:
    """Return quads (Q, 4) as triangles (2 Q, 3), split between corners on a crease, else along the shorter diagonal."""
    a, b, c, d = (points[quads[:, k]] for k in range(4))
    first = sharp[quads[:, 0]].astype(int) + sharp[quads[:, 2]]
    second = sharp[quads[:, 1]].astype(int) + sharp[quads[:, 3]]
    shorter = ((a - c) ** 2).sum(axis=1) <= ((b - d) ** 2).sum(axis=1)
    straight = (first > second) | ((first == second) & shorter)
    p, q, r, s = (np.where(straight, quads[:, k], quads[:, (k + 1) % 4]) for k in range(4))
    return np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)])
