"""Manifold dual contouring: the surface between nodes inside and outside on a sparse regular grid.

Dual contouring (Ju, Losasso, Schaefer, Warren 2002) puts one vertex into each cell that the surface passes: the
minimum of the quadric of the points and normals at which it crosses the cell's edges, so that creases and corners come
out sharp. Where several sheets pass one cell each gets a vertex of its own (Nielson 2004; Schaefer, Ju, Warren 2007).
Each crossed edge gives two triangles between the vertices of the four cells about it. Cells may be divided; then the
edges are the shortest ones, and a cell beside divided ones may be about an edge twice.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.mesh.normals import unit_or_zero

_CORNERS = np.array([[(corner >> axis) & 1 for axis in range(3)] for corner in range(8)])
"""The corners (8, 3) of a cell; bit k of a corner's number tells its place along axis k."""
_EDGES = np.array([(corner, corner | 1 << axis) for axis in range(3) for corner in range(8) if not corner >> axis & 1])
"""The edges (12, 2) of a cell: four along x, four along y, four along z."""
_AROUND = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
"""How many cells back, along the two axes across an edge, the four cells about it begin, in order about it."""
_FLAT = 0.05
"""Eigenvalues of the quadric below this share of the largest count as 0: the surface is flat in that direction."""
_POWERS = 4
"""Steps of the power iteration for a flat cell's normal: each makes its error 20 times smaller, or more."""


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

    keys (E,): of the edges' lower nodes. axes (E,): along which the edges run. lengths (E,): of the edges, in steps of
    the grid. outward (E,): whether the lower node is outside. points (E, 3), normals (E, 3): of the surface there,
    metres and unit, normals outwards.
    """

    keys: Ints
    axes: Ints
    lengths: Ints
    outward: Bools
    points: Floats
    normals: Floats


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of a grid, `parts` steps wide, but for some that are divided into cells of one step.

    divided (C,): ascending keys of the lower corners of the divided cells.
    """

    grid: Grid
    parts: int
    divided: Ints

    def about(self, keys: Ints, axes: Ints, lengths: Ints) -> tuple[Ints, Ints]:
        """Return the keys (E, 4) of the cells about edges (E,), in order about them, and their widths (E, 4) in steps.

        An edge of one step that is not on an edge of an undivided cell has that cell twice.
        """
        around = self.grid.strides[np.stack([(axes + 1) % 3, (axes + 2) % 3], axis=1)] @ _AROUND.T
        cells, width = keys[:, None] - lengths[:, None] * around, np.repeat(lengths[:, None], 4, axis=1)
        if self.parts > 1:
            fine = np.flatnonzero(lengths == 1)
            whole = self.grid.keys(self.grid.nodes(cells[fine]) // self.parts * self.parts)
            kept = np.isin(whole, self.divided)
            cells[fine], width[fine] = np.where(kept, cells[fine], whole), np.where(kept, 1, self.parts)
        return cells, width


def dual_contour(cells: Cells, keys: Ints, outside: Bools, crossings: Crossings) -> tuple[Floats, Ints, Bools]:
    """Return vertices (V, 3), triangles (T, 3), facing outwards, and which vertices (V,) lie on a crease or corner.

    keys (N,): ascending, of the nodes that are known, among them all corners of the cells about crossings. outside
    (N,): their states. No vertex lies outside its cell, but on creases by up to half its width. An undivided cell
    beside a divided one has one vertex for all sheets of the surface.
    """
    grid = cells.grid
    strides = grid.strides
    cell_keys, width = cells.about(crossings.keys, crossings.axes, crossings.lengths)
    # The number of the edge within each of the four cells about it.
    corner = (1 << (crossings.axes[:, None] + 1) % 3) * _AROUND[:, 0]
    corner += (1 << (crossings.axes[:, None] + 2) % 3) * _AROUND[:, 1]
    edge = _edge_numbers()[crossings.axes[:, None], corner]
    known, first, cell = np.unique(cell_keys, return_index=True, return_inverse=True)
    cell, own = cell.reshape(-1, 4), width.ravel()[first]
    corners = np.searchsorted(keys, known[:, None] + own[:, None] * (_CORNERS @ strides))
    pattern = outside[corners] @ (1 << np.arange(8))
    mixed = np.zeros(len(known), dtype=np.bool_)
    mixed[cell[width != crossings.lengths[:, None]]] = True
    sheet = np.where(mixed[cell], 0, _sheets()[pattern[cell], edge])
    vertices, vertex = np.unique(4 * cell + sheet, return_inverse=True)
    vertex, of_cell = vertex.reshape(-1, 4), vertices // 4
    step = (grid.step * own[of_cell][:, None]).astype(np.float64)
    points, sharp = _quadric_minima(crossings, vertex, len(vertices), grid.points(known[of_cell]), step)
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


def _quadric_minima(crossings: Crossings, vertex: Ints, count: int, low: Floats, step: Floats) -> tuple[Floats, Bools]:
    """Return for each vertex (V, 3) the point nearest to all its tangent planes, and whether (V,) they form a crease.

    vertex (E, 4): the vertices about each crossing. low (V, 3): the lower corners of their cells, step (V, 1):
    the cells' widths, metres. On a crease the point may lie half a width outside: the tip of a groove often does.
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
    # Few cells hold a crease. In the others one eigenvalue counts, and its vector is soon found from the mean normal.
    way = unit_or_zero(np.stack([total(n[:, k]) for k in range(3)], axis=1))
    for _ in range(_POWERS):
        way = unit_or_zero(np.einsum("vij,vj->vi", quadric, way))
    largest = np.einsum("vi,vi->v", way, np.einsum("vij,vj->vi", quadric, way))
    sharp = np.trace(quadric, axis1=1, axis2=2) > (1.0 + _FLAT) * largest
    points = middle + (np.einsum("vi,vi->v", way, right) / np.where(sharp, 1.0, largest))[:, None] * way
    rows = np.flatnonzero(sharp)
    values, ways = np.linalg.eigh(quadric[rows])
    counts = values > _FLAT * values[:, -1:]
    inverse = np.where(counts, 1.0 / np.where(counts, values, 1.0), 0.0)
    points[rows] = middle[rows] + np.einsum("vij,vj->vi", ways, inverse * np.einsum("vji,vj->vi", ways, right[rows]))
    sharp[rows] = counts[:, 1]
    beyond = np.where(sharp[:, None], 0.5 * step, 0.0)
    return np.clip(points, low - beyond, low + step + beyond), sharp


def _triangles(points: Floats, quads: Ints, sharp: Bools) -> Ints:
    """Return quads (Q, 4) as triangles (2 Q, 3), split between corners on a crease, else along the shorter diagonal.

    Three corners on one crease are nearly in line: they make no triangle where another split avoids it.
    """
    a, b, c, d = (points[quads[:, k]] for k in range(4))
    on_a, on_b, on_c, on_d = sharp[quads].T
    ends = on_a.astype(int) + on_c - on_b - on_d
    in_line = on_a * on_c * (on_b.astype(int) + on_d) - on_b * on_d * (on_a.astype(int) + on_c)
    shorter = ((a - c) ** 2).sum(axis=1) <= ((b - d) ** 2).sum(axis=1)
    straight = (in_line < 0) | (in_line == 0) & ((ends > 0) | (ends == 0) & shorter)
    p, q, r, s = (np.where(straight, quads[:, k], quads[:, (k + 1) % 4]) for k in range(4))
    triangles = np.concatenate([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)])
    return triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]
