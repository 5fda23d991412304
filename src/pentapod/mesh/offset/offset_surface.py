"""Offset surface: the level set of the distance from a mesh, seen from outside, as a mesh of its own.

It is where the centre of a ball is that rolls over the part without cutting into it. A sparse grid finds it: the
distance changes by no more than the way, so a block of cells whose middle is further from the level than its corners
are from the middle holds none of it. Nodes that are not reached from the grid's border are inside, whatever their
distance: neither the mirrored sheet within a closed part nor cavities count. Any mesh will do, open ones and soups too.
Where narrow channels run between the nodes, the grid is made finer (`refinement`).

Of a large part a window may be enough. Its nodes and cells are those of the whole grid, and distances are from the
whole mesh, so that the surface in it is the same to the bit. Where its sides cut through the part, what is outside is
known by the way of a ball from there along a view.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.errors import MeshError
from pentapod.mesh.offset.dual_contouring import Crossings, Grid, dual_contour
from pentapod.mesh.offset.refinement import Edges, Nodes, divided, indices, missed_cells
from pentapod.mesh.query.tree import FacetTree
from pentapod.numerics.threads import for_rows

MOST_NODES, MOST_BLOCKS = 30_000_000, 60_000_000
_BLOCK, _GROUP = 4, 8
"""Steps along the side of a block, blocks along that of a group: a group far from the level needs one query."""
_KEY_BITS = 53.0
"""Bits of the largest key of a node, with room for finer grids."""
_SHIFT = np.array([0.3819660, 0.2679492, 0.4142136])
"""Shares of a step by which the grid is off the part, so that flat faces do not lie in its planes."""
_UNTOLD, _INSIDE, _OUTSIDE = np.arange(3, dtype=np.int8)
"""Sides of a node: not told by the middle of its block, or on that side of the level."""
_SIDE_BITS = 2
_ROUNDS, _ON_LEVEL = 3, 1e-11
"""How often a vertex is moved towards the level, while it is off by this share."""


@dataclass(frozen=True, eq=False)
class Window:
    """Where an offset surface is needed. box (2, 3): lowest and highest coordinates, metres; more is made around it.

    view (3,): unit. Where the box cuts through the part, a place is outside if a ball can go from there along the view
    and never meets the part, or if it is connected with such a place within the box.
    """

    box: Floats
    view: Floats


def offset_surface(
    tree: FacetTree, distance: float, step: float, parts: int = 1, window: Window | None = None
) -> tuple[Floats, Ints]:
    """Return vertices (V, 3) and triangles (T, 3), facing outwards, of what is `distance` metres from a mesh's facets.

    step: metres between the grid's nodes, at most a quarter of the distance. parts: how many times finer the grid is
    where a channel, in which a ball of that radius has less play than a step, runs between the nodes; 1: it may be
    closed, as one with less play than the finer step may be. Vertices lie on the level, but near creases, where they
    are within a share of a step of it. window: of the surface that is needed; None for all. Raises MeshError where the
    grid would have more nodes than MOST_NODES.
    """
    grid, groups = _grid(tree, distance, step)
    blocks = _Blocks.of(grid, groups, window)
    if int(np.prod(blocks.high - blocks.low)) > MOST_BLOCKS:
        raise _too_fine(tree, step)
    keys, outside, wide = _nodes(tree, grid, blocks, distance)
    nodes = Nodes.of(grid, keys, outside)
    vertices, triangles = _contour(tree, nodes, blocks, wide, distance)
    if parts > 1 and len(missed := missed_cells(tree, nodes, vertices, triangles, distance)):
        parts = min(parts, int((MOST_NODES / len(missed)) ** (1.0 / 3.0)))
        return _contour(tree, divided(tree, nodes, missed, parts, distance), blocks, wide, distance)
    return vertices, triangles


@dataclass(frozen=True, eq=False)
class _Blocks:
    """The blocks of a grid that are looked at: from low (3,) to high (3,), whole groups of them.

    cut (3, 2): whether there is more of the grid beyond the lower and the upper side along each axis. view (3,): along
    which a ball goes from there.
    """

    low: Ints
    high: Ints
    cut: Bools
    view: Floats

    @classmethod
    def of(cls, grid: Grid, groups: Ints, window: Window | None) -> _Blocks:
        """Return the blocks around a window, or all of a grid with so many groups (3,) of blocks."""
        low, high = np.zeros_like(groups), groups
        if window is not None:
            places = (window.box - grid.low) / (_GROUP * _BLOCK * grid.step)
            low = np.clip(np.floor(places[0]).astype(np.intp), 0, groups - 1)
            high = np.clip(np.ceil(places[1]).astype(np.intp), low + 1, groups)
        cut = np.stack([low > 0, high < groups], axis=1)
        return cls(_GROUP * low, _GROUP * high, cut, np.zeros(3) if window is None else window.view)

    def holds(self, nodes: Ints, axes: npt.NDArray[np.int16], parts: int) -> Bools:
        """Return whether all cells about edges (E,) are among the blocks; nodes (E, 3): the edges' lower ones.

        parts: of a step along the sides of the grid's cells.
        """
        low, high = _BLOCK * parts * self.low, _BLOCK * parts * self.high
        across = np.arange(3) != axes[:, None]
        return ~(across & ((nodes <= low) | (nodes >= high))).any(axis=1)


def _contour(tree: FacetTree, nodes: Nodes, blocks: _Blocks, wide: Bools, distance: float) -> tuple[Floats, Ints]:
    """Return vertices (V, 3) and triangles (T, 3) of the level between known nodes, of what is reached from outside.

    wide: which of the blocks are outside and not near the level.
    """
    from pentapod.mesh.offset.offset_kernels import cross_level  # noqa: PLC0415  loads numba

    cells, edges = nodes.cells, nodes.edges()
    outside = _reached(tree, nodes, edges, blocks, wide, distance)
    crossed = np.flatnonzero(outside[edges.first] != outside[edges.last])
    if blocks.cut.any():
        lower = cells.grid.nodes(nodes.keys[edges.first[crossed]])
        crossed = crossed[blocks.holds(lower, edges.axes[crossed], cells.parts)]
    rows = edges.first[crossed]
    axes, lengths = (of_edges[crossed].astype(np.intp) for of_edges in (edges.axes, edges.lengths))
    starts = cells.grid.points(nodes.keys[rows])
    points, normals = np.empty_like(starts), np.empty_like(starts)
    metres = (cells.grid.step * lengths).astype(np.float64)
    given = (distance, tree.corners, tree.starts, tree.extents)
    for_rows(cross_level, (starts, axes, metres, outside[rows]), given, (points, normals))
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
    given = (distance, rounds, accuracy * distance, tree.corners, tree.starts, tree.extents)
    for_rows(move_onto_level, (points,), given, (gaps,))
    return points, gaps


def _grid(tree: FacetTree, distance: float, step: float) -> tuple[Grid, Ints]:
    """Return the grid around all that is within the distance of a mesh, and its shape (3,) in groups of blocks."""
    low = tree.extents[0, 0] - distance - (2.0 + _SHIFT) * step
    size = tree.extents[0, 1] + distance + 2.0 * step - low
    groups = np.ceil(size / (_GROUP * _BLOCK * step))
    if float(np.log2(_GROUP * _BLOCK * groups + 1.0).sum()) > _KEY_BITS:
        raise _too_fine(tree, step)
    return Grid(low, step, (_GROUP * _BLOCK * groups).astype(np.intp) + 1), groups.astype(np.intp)


def _too_fine(tree: FacetTree, step: float) -> MeshError:
    """Return the error of a grid with too many nodes: most often the unit of the mesh is wrong."""
    width = 1e3 * float(np.ptp(tree.extents[0], axis=0).max())
    return MeshError(
        f"the offset surface is too fine for this part, which is {width:,.0f} mm wide", key="step", value=step,
        expected=f"at most {MOST_NODES:,} nodes near the surface, {MOST_BLOCKS:,} blocks of {_BLOCK}³ around it",
        remedy="is the unit of the mesh right? If it is, take a larger tool, or less of the part",
    )  # fmt: skip


def _nodes(tree: FacetTree, grid: Grid, blocks: _Blocks, level: float) -> tuple[Ints, Bools, Bools]:
    """Return ascending keys (N,) of the nodes of blocks near the level, and whether they are outside.

    And whether each of the blocks is outside and not near the level.
    """

    def classed(cells: Ints, size: int) -> tuple[Floats, Bools]:
        """Return how far beyond the level the middles of cells (M, 3) of `size` steps are, and which may hold it."""
        half = 0.5 * math.sqrt(3.0) * size * grid.step
        gap = tree.closest(grid.low + (cells + 0.5) * (size * grid.step), level + 1.01 * half)[0]
        return gap - level, np.abs(gap - level) <= 1.001 * half

    groups = (blocks.high - blocks.low) // _GROUP
    group = blocks.low // _GROUP + np.indices(tuple(groups)).reshape(3, -1).T
    beyond, near = classed(group, _GROUP * _BLOCK)
    wide = ((beyond > 0.0) & ~near).reshape(tuple(groups))
    for axis in range(3):
        wide = wide.repeat(_GROUP, axis=axis)
    block = (_GROUP * group[near][:, None] + np.indices((_GROUP,) * 3).reshape(3, -1).T).reshape(-1, 3)
    beyond, near = classed(block, _BLOCK)
    wide[tuple((block - blocks.low).T)] = (beyond > 0.0) & ~near
    block, beyond = block[near], beyond[near]
    if len(block) * _BLOCK**3 > MOST_NODES:
        raise _too_fine(tree, grid.step)
    within = np.indices((_BLOCK + 1,) * 3).reshape(3, -1).T
    keys = grid.keys(_BLOCK * block)[:, None] + grid.keys(within)
    # A node that is nearer to the middle of its block than this is to the level lies on the same side of it.
    reach = 1.001 * grid.step * np.linalg.norm(within - 0.5 * _BLOCK, axis=1)
    told = np.where(beyond > 0.0, _OUTSIDE, _INSIDE)[:, None]
    # The side stands below the key: the last of equal keys is one whose side is told, where there is one.
    keys <<= _SIDE_BITS
    keys |= np.where(np.abs(beyond)[:, None] > reach, told, _UNTOLD)
    keys = keys.ravel()
    keys.sort()
    sides = keys & (1 << _SIDE_BITS) - 1
    keys >>= _SIDE_BITS
    last = np.concatenate([keys[1:] != keys[:-1], [True]])
    keys, sides = keys[last], sides[last]
    outside, untold = sides == _OUTSIDE, np.flatnonzero(sides == _UNTOLD)
    outside[untold] = ~tree.within(grid.points(keys[untold]), level)
    return keys, outside, wide


def _reached(tree: FacetTree, nodes: Nodes, edges: Edges, blocks: _Blocks, wide: Bools, level: float) -> Bools:
    """Return which nodes (N,) outside are connected, along edges of the grid, with what is beyond its border."""
    from scipy import ndimage  # noqa: PLC0415  slow, and commands that draw nothing load this file

    keys, outside = nodes.keys, nodes.outside
    both = outside[edges.first] & outside[edges.last]
    pairs = [np.stack([edges.first[both], edges.last[both]])]
    # Connected wide blocks are one node of the graph each. The border is padded around them, but where it is cut.
    label = np.zeros(np.array(wide.shape) + 2, dtype=np.int32)
    padded = np.pad(wide, 1, constant_values=tuple((not low, not high) for low, high in blocks.cut.tolist()))
    count = int(ndimage.label(padded, output=label))  # pyright: ignore[reportArgumentType]
    beyond = len(keys) - 1 + count + 1
    border = np.ones(label.shape, dtype=np.bool_)
    border[1:-1, 1:-1, 1:-1] = False
    known = np.unique(label[border & padded]) + len(keys) - 1
    pairs.append(np.stack([known, np.full(len(known), beyond)]))
    for axis in range(3):
        a, b = (label.take(range(k, label.shape[axis] - 1 + k), axis=axis) for k in (0, 1))
        # A wide block and one near the level share a face. Its middle node is known, and outside.
        one = (a > 0) != (b > 0)
        face = _BLOCK * (np.argwhere(one) - 1 + blocks.low) + _BLOCK // 2
        face[:, axis] += _BLOCK // 2
        index = indices(keys, nodes.cells.grid.keys(nodes.cells.parts * face))
        pairs.append(np.stack([index, len(keys) - 1 + np.maximum(a, b)[one]])[:, index >= 0])
    if blocks.cut.any():
        inner = label[1:-1, 1:-1, 1:-1].astype(np.intp)
        pairs.append(_escaping(tree, nodes, blocks, inner, level, beyond))
    joined = np.concatenate(pairs, axis=1)
    size = beyond + 1
    graph = coo_array((np.ones(joined.shape[1], dtype=np.bool_), (joined[0], joined[1])), shape=(size, size))
    piece = connected_components(graph, directed=False)[1]
    return outside & (piece[: len(keys)] == piece[beyond])


def _escaping(tree: FacetTree, nodes: Nodes, blocks: _Blocks, label: Ints, level: float, beyond: int) -> Ints:
    """Return pairs (2, M) that join with what is beyond the grid from where a ball can leave the part along the view.

    They are nodes on, and connected wide blocks at, cut sides through which the view leads out. label: of the blocks.
    """
    grid, parts, view = nodes.cells.grid, nodes.cells.parts, blocks.view
    places, owners = list[Floats](), list[Ints]()
    at = grid.nodes(nodes.keys)
    for axis in range(3):
        upper = int(view[axis] > 0.0)
        if view[axis] == 0.0 or not blocks.cut[axis, upper]:
            continue
        side = _BLOCK * parts * (blocks.high if upper else blocks.low)[axis]
        rows = np.flatnonzero(nodes.outside & (at[:, axis] == side))
        places.append(grid.points(nodes.keys[rows]))
        owners.append(rows)
        wide = np.argwhere(label.take([-1 if upper else 0], axis=axis) > 0)
        wide[:, axis] += (label.shape[axis] - 1) if upper else 0
        places.append(grid.low + (wide + blocks.low + 0.5) * (_BLOCK * parts * grid.step))
        owners.append(len(nodes.keys) - 1 + label[tuple(wide.T)])
    if not places:
        return np.empty((2, 0), dtype=np.intp)
    starts, owner = np.concatenate(places), np.concatenate(owners)
    ends = np.where(view > 0.0, tree.extents[0, 1], tree.extents[0, 0])
    way = np.maximum(ends @ view + level - starts @ view, 0.0)
    clear = tree.clear(starts, starts + way[:, None] * view, level)
    return np.stack([owner[clear], np.full(int(clear.sum()), beyond)])
