"""Marching tetrahedra: the surface where a function on a regular grid is zero."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats, Ints, as_floats

# Kuhn's six tetrahedra: from corner 0 to corner 7 (bits x, y, z), one axis at a time, in every order of the axes. They
# fit across the faces of neighbouring cells, so the surface is closed.
_ORDERS = list(itertools.permutations(range(3)))
_LEFT_HANDED = [(b - a) % 3 != 1 for a, b, _ in _ORDERS]  # odd orders of the axes
_PATHS = [(0, 1 << a, (1 << a) | (1 << b), 7) for a, b, _ in _ORDERS]
_TETRAHEDRA = np.array(
    [(a, c, b, d) if odd else (a, b, c, d) for odd, (a, b, c, d) in zip(_LEFT_HANDED, _PATHS, strict=True)]
)
_REFERENCE = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])


def zero_surface(values: ArrayLike, origin: ArrayLike, step: float) -> tuple[Floats, Ints]:
    """Return vertices (V, 3) and triangles (T, 3) of the surface around where `values` (nx, ny, nz) are positive.

    Node (i, j, k) lies at origin + step · (i, j, k). The function is taken to be linear on six tetrahedra a cell; what
    reaches the border of the grid is closed there, at most half a cell outside. Triangles face outwards; the surface is
    watertight, without a vertex twice. Nodes with value 0 count as inside.
    """
    inner = as_floats(values, "values", (None, None, None))
    grid = np.full(tuple(n + 2 for n in inner.shape), -float(np.abs(inner).max(initial=0.0)) - step)
    grid[1:-1, 1:-1, 1:-1] = inner
    shape = np.array(grid.shape)
    stride = np.array([shape[1] * shape[2], shape[2], 1])
    corners = np.array([[(c >> axis) & 1 for axis in range(3)] for c in range(8)]) @ stride
    flat = grid.ravel()
    cells = np.indices(tuple(shape - 1)).reshape(3, -1).T @ stride
    inside = flat >= 0.0
    some = inside[cells[:, None] + corners].sum(axis=1)
    cells = cells[(some > 0) & (some < 8)]
    tetrahedra = (cells[:, None, None] + corners[_TETRAHEDRA]).reshape(-1, 4)
    edges = _crossed(tetrahedra, inside[tetrahedra])
    if not len(edges):
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.intp)
    ends = np.sort(edges.reshape(-1, 2), axis=1)
    unique, triangles = np.unique(ends[:, 0] * np.int64(flat.size) + ends[:, 1], return_inverse=True)
    a, b = unique // flat.size, unique % flat.size
    t = flat[a] / (flat[a] - flat[b])
    nodes = np.stack(np.unravel_index(np.stack([a, b]), grid.shape), axis=-1) - 1.0
    vertices = nodes[0] + t[:, None] * (nodes[1] - nodes[0])
    return as_floats(origin, "origin", (3,)) + step * vertices, triangles.reshape(-1, 3).astype(np.intp)


def _crossed(tetrahedra: Ints, inside: Bools) -> Ints:
    """Return the triangles (T, 3, 2), each corner as the edge of a tetrahedron on which it lies, facing outwards."""
    pattern = inside @ (1 << np.arange(4))
    found: list[Ints] = []
    for number in range(1, 15):
        chosen = tetrahedra[pattern == number]
        found += [np.stack([chosen[:, list(edge)] for edge in loop], axis=1) for loop in _loops(number)]
    return np.concatenate(found)


def _loops(pattern: int) -> list[list[tuple[int, int]]]:
    """Return the one or two triangles, as edges, of a right-handed tetrahedron; pattern: bits of the corners inside."""
    within, without = ([k for k in range(4) if pattern >> k & 1 == bit] for bit in (1, 0))
    if len(within) == 2:
        (a, b), (c, d) = within, without
        loops = [[(a, c), (a, d), (b, d)], [(a, c), (b, d), (b, c)]]
    else:
        loops = [[(a, b) for a in within for b in without]]
    outwards = _REFERENCE[without].mean(axis=0) - _REFERENCE[within].mean(axis=0)
    turned: list[list[tuple[int, int]]] = []
    for loop in loops:
        p, q, r = (_REFERENCE[list(edge)].mean(axis=0) for edge in loop)
        turned.append(loop if np.linalg.det([q - p, r - p, outwards]) > 0.0 else loop[::-1])
    return turned


def enclosed_volume(vertices: Floats, triangles: Ints) -> float:
    """Return the volume inside a closed surface whose triangles face outwards."""
    if not len(triangles):
        return 0.0
    a, b, c = (vertices[triangles[:, k]] - vertices.mean(axis=0) for k in range(3))
    return float(np.einsum("nk,nk->", a, np.asarray(np.cross(b, c), dtype=np.float64)) / 6.0)
