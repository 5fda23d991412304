"""Offset surface: the level set of the distance from a mesh, seen from outside, as a mesh of its own.

It is where the centre of a ball is that rolls over the part without cutting into it. A sparse grid finds it: the
distance changes by no more than the way, so a block of cells whose middle is further from the level than its corners
are from the middle holds none of it. Nodes that are not reached from the grid's border are inside, whatever their
distance: neither the mirrored sheet within a closed part nor cavities count. Any mesh will do, open ones and soups too.
Where narrow channels run between the nodes, the grid is made finer (`refinement`).
"""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.errors import MeshError
from pentapod.mesh.offset.dual_contouring import Crossings, Grid, dual_contour
from pentapod.mesh.offset.refinement import Edges, Nodes, divided, indices, missed_cells
from pentapod.mesh.query.tree import FacetTree

MOST_NODES, MOST_BLOCKS = 30_000_000, 60_000_000
_BLOCK, _GROUP = 4, 8
"""Steps along the side of a block, blocks along that of a group: a group far from the level needs one query."""
_SHIFT = np.array([0.3819660, 0.2679492, 0.4142136])
"""Shares of a step by which the grid is off the part, so that flat faces do not lie in its planes."""
_ROUNDS, _ON_LEVEL = 3, 1e-11
"""How often a vertex is moved towards the level, while it is off by this share."""


def offset_surface(tree: FacetTree, distance: float, step: float, parts: int = 1) -> tuple[Floats, Ints]:
    """Return vertices (V, 3) and triangles (T, 3), facing outwards, of what is `distance` metres from a mesh's facets.

    step: metres between the grid's nodes, at most a quarter of the distance. parts: how many times finer the grid is
    where a channel, in which a ball of that radius has less play than a step, runs between the nodes; 1: it may be
    closed, as one with less play than the finer step may be. Vertices lie on the level, but near creases, where they
    are within a share of a step of it. Raises MeshError where the grid would have more nodes than MOST_NODES.
    """
    grid, groups = _grid(tree, distance, step)
    keys, outside, wide = _nodes(tree, grid, groups, distance)
    nodes = Nodes.of(grid, keys, outside)
    vertices, triangles = _contour(tree, nodes, wide, distance)
    if parts > 1 and len(missed := missed_cells(tree, nodes, vertices, distance)):
        parts = min(parts, int((MOST_NODES / len(missed)) ** (1.0 / 3.0)))
        return _contour(tree, divided(tree, nodes, missed, parts, distance), wide, distance)
    return vertices, triangles


def _contour(tree: FacetTree, nodes: Nodes, wide: Bools, distance: float) -> tuple[Floats, Ints]:
    """Return vertices (V, 3) and triangles (T, 3) of the level between known nodes, of what is reached from outside.

    wide: blocks of the grid outside and not near the level.
    """
    from pentapod.mesh.offset.offset_kernels import cross_level  # noqa: PLC0415  loads numba

    cells, edges = nodes.cells, nodes.edges()
    outside = _reached(nodes, edges, wide)
    crossed = outside[edges.first] != outside[edges.last]
    rows, axes, lengths = edges.first[crossed], edges.axes[crossed], edges.lengths[crossed]
    starts = cells.grid.points(nodes.keys[rows])
    points, normals = np.empty_like(starts), np.empty_like(starts)
    metres = (cells.grid.step * lengths).astype(np.float64)
    cross_level(starts, axes, metres, distance, tree.corners, tree.starts, tree.extents, points, normals)
    crossings = Crossings(nodes.keys[rows], axes, lengths, outside[rows], points, normals)
    vertices, triangles, _ = dual_contour(cells, nodes.keys, outside, crossings)
    return onto_level(tree, vertices, distance, _ROUNDS, _ON_LEVEL)[0], triangles


def onto_level(
    tree: FacetTree, points: Floats, distance: float, rounds: int, accuracy: float = 0.0
) -> tuple[Floats, Floats]:
    """Return points (N, 3) moved to `distance` from the mesh, the shortest way, and the distances (N,) that they reach.

    Where two or three walls bound a ball, its centre is moved to where it touches them at once. accuracy: error of the
    distance, as a share of it, at which a point is no longer moved. rounds: of moving it; some places, such as a gap
    that is too narrow for the ball, are not left in any number of them.
    """
    from pentapod.mesh.offset.level_kernels import move_onto_level  # noqa: PLC0415  loads numba

    points, gaps = np.array(points, dtype=np.float64), np.empty(len(points))
    move_onto_level(points, distance, rounds, accuracy * distance, tree.corners, tree.starts, tree.extents, gaps)
    return points, gaps


def _grid(tree: FacetTree, distance: float, step: float) -> tuple[Grid, Ints]:
    """Return the grid around all that is within the distance of a mesh, and its shape (3,) in groups of blocks."""
    low = tree.extents[0, 0] - distance - (2.0 + _SHIFT) * step
    size = tree.extents[0, 1] + distance + 2.0 * step - low
    groups = np.ceil(size / (_GROUP * _BLOCK * step))
    if groups.prod() * _GROUP**3 > MOST_BLOCKS:
        raise _too_fine(step)
    return Grid(low, step, (_GROUP * _BLOCK * groups).astype(np.intp) + 1), groups.astype(np.intp)


def _too_fine(step: float) -> MeshError:
    return MeshError(
        "the offset surface is too fine for this part", key="step", value=step,
        expected=f"at most {MOST_NODES:,} nodes near the surface, {MOST_BLOCKS:,} blocks of {_BLOCK}³ around it",
        remedy="check the unit of the mesh and the size of the tool",
    )  # fmt: skip


def _nodes(tree: FacetTree, grid: Grid, groups: Ints, level: float) -> tuple[Ints, Bools, Bools]:
    """Return ascending keys (N,) of the nodes of blocks near the level, and whether they are outside.

    And whether each block of the grid is outside and not near the level.
    """

    def classed(cells: Ints, size: int) -> tuple[Bools, Bools]:
        """Return which cells (M, 3) of `size` steps may hold some of the level, and which are outside of it."""
        half = 0.5 * math.sqrt(3.0) * size * grid.step
        gap = tree.closest(grid.low + (cells + 0.5) * (size * grid.step), level + 1.01 * half)[0]
        near = np.abs(gap - level) <= 1.001 * half
        return near, (gap > level) & ~near

    group = np.indices(tuple(groups)).reshape(3, -1).T
    near, out = classed(group, _GROUP * _BLOCK)
    wide = out.reshape(tuple(groups))
    for axis in range(3):
        wide = wide.repeat(_GROUP, axis=axis)
    block = (_GROUP * group[near][:, None] + np.indices((_GROUP,) * 3).reshape(3, -1).T).reshape(-1, 3)
    near, out = classed(block, _BLOCK)
    wide[tuple(block.T)] = out
    block = block[near]
    if len(block) * _BLOCK**3 > MOST_NODES:
        raise _too_fine(grid.step)
    within = np.indices((_BLOCK + 1,) * 3).reshape(3, -1).T
    keys = (grid.keys(_BLOCK * block)[:, None] + grid.keys(within)).ravel()
    keys.sort()
    keys = keys[np.concatenate([[True], keys[1:] != keys[:-1]])]
    return keys, ~tree.within(grid.points(keys), level), wide


def _reached(nodes: Nodes, edges: Edges, wide: Bools) -> Bools:
    """Return which nodes (N,) outside are connected, along edges of the grid, with what is beyond its border."""
    from scipy import ndimage  # noqa: PLC0415  slow, and commands that draw nothing load this file

    keys, outside = nodes.keys, nodes.outside
    both = outside[edges.first] & outside[edges.last]
    pairs = [np.stack([edges.first[both], edges.last[both]])]
    # Connected wide blocks are one node of the graph each; the first holds the border, which is padded around them.
    label = np.zeros(np.array(wide.shape) + 2, dtype=np.int32)
    count = int(ndimage.label(np.pad(wide, 1, constant_values=True), output=label))  # pyright: ignore[reportArgumentType]
    for axis in range(3):
        a, b = (label.take(range(k, label.shape[axis] - 1 + k), axis=axis) for k in (0, 1))
        # A wide block and one near the level share a face. Its middle node is known, and outside.
        one = (a > 0) != (b > 0)
        face = _BLOCK * (np.argwhere(one) - 1) + _BLOCK // 2
        face[:, axis] += _BLOCK // 2
        index = indices(keys, nodes.cells.grid.keys(nodes.cells.parts * face))
        pairs.append(np.stack([index, len(keys) - 1 + np.maximum(a, b)[one]])[:, index >= 0])
    joined = np.concatenate(pairs, axis=1)
    size = len(keys) + count
    graph = coo_array((np.ones(joined.shape[1], dtype=np.bool_), (joined[0], joined[1])), shape=(size, size))
    piece = connected_components(graph, directed=False)[1]
    return outside & (piece[: len(keys)] == piece[len(keys)])
