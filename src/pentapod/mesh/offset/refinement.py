"""Local refinement of the grid of an offset surface, where the surface runs between its nodes.

All corners of a cell are inside, and yet a channel may run through it, in which the ball has less play than a step. The
distance grows along its gradient by as much as the way, up to where another part of the mesh is as near: the way from a
node inside, away from its closest point, leads to the level and just beyond. If that place is outside, but in a cell
all of whose corners are inside, the grid misses it there. Such cells, and those around them, are divided.

A channel about as wide as a cell may be met by some of its edges only: then facets lead across it. Their middles are
beyond the level, and the cells there are divided as well. So are those at the tip of a steep pit, such as over
a hole narrower than the ball, where facets cut its tip off.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.runs import distinct
from pentapod.mesh.normals import corner_angles
from pentapod.mesh.offset.dual_contouring import Cells, Grid
from pentapod.mesh.query.tree import FacetTree
from pentapod.mesh.topology import components
from pentapod.numerics.threads import nearest_points

_BEYOND = 0.01
"""How far beyond the level a place is looked at, as a share of the distance: half of the least play that is found."""
_ACROSS = 0.05
"""How far beyond the level the middle of a facet is that leads across a channel, as a share of the distance."""
_PIT, _OFF_TIP = 1.5, 0.01
"""Angle, radians, that facets about a vertex lack of a full turn at the tip of a steep pit; how far beyond the level
the middle of one is that cuts it off, as a share of the distance. In shallow pits a vertex beside the tip is hardly
higher, and rough surfaces have many: with 0.5 one had four times as many facets, and tips over holes of at least 0.85
of the ball's diameter were no nearer (over holes of 0.75 within 0.035 radii instead of 0.052)."""
_LINK = 1.0
"""How near, in distances, a missed place is to the surface or another such place: mirrored sheets are two away."""
_CORNERS = np.indices((2, 2, 2)).reshape(3, -1).T


@dataclass(frozen=True, eq=False)
class Edges:
    """Edges (E,) between nodes: the rows of both ends, the axes along which they run, their lengths in steps."""

    first: Ints
    last: Ints
    axes: npt.NDArray[np.int16]
    lengths: npt.NDArray[np.int16]


@dataclass(frozen=True, eq=False)
class Nodes:
    """Known nodes of a grid. keys (N,): ascending. outside (N,): whether the distance there is above the level.

    whole (N,): whether they are corners of undivided cells' lattice; fine (N,): whether they belong to a divided cell.
    """

    cells: Cells
    keys: Ints
    outside: Bools
    whole: Bools
    fine: Bools

    @classmethod
    def of(cls, grid: Grid, keys: Ints, outside: Bools) -> Nodes:
        """Return the nodes of a grid without divided cells."""
        every = np.ones(len(keys), dtype=np.bool_)
        return cls(Cells(grid, 1, np.empty(0, dtype=np.intp)), keys, outside, every, ~every)

    def edges(self) -> Edges:
        """Return the shortest edges between known nodes of which one or both are outside: none of shorter ones."""
        found: list[tuple[Ints, Ints, int, int]] = []
        strides, parts = self.cells.grid.strides, self.cells.parts
        for axis in range(3):
            for length, own in ((parts, self.whole), (1, self.fine))[: 2 if parts > 1 else 1]:
                first = np.flatnonzero(own)
                last = indices(self.keys, self.keys[first] + length * strides[axis])
                joined = (last >= 0) & own[last] & (self.outside[first] | self.outside[last])
                first, last = first[joined], last[joined]
                if length > 1 and len(self.cells.divided):
                    across = np.delete(strides, axis)
                    about = self.keys[first][:, None] - length * (_CORNERS[:4, 1:] @ across)
                    undivided = (indices(self.cells.divided, about) < 0).all(axis=1)
                    first, last = first[undivided], last[undivided]
                found.append((first, last, axis, length))
        first, last = (np.concatenate([f[k] for f in found]) for k in (0, 1))
        counts = [len(f[0]) for f in found]
        axes, lengths = (np.repeat(np.array([f[k] for f in found], dtype=np.int16), counts) for k in (2, 3))
        return Edges(first, last, axes, lengths)


def indices(keys: Ints, wanted: Ints) -> Ints:
    """Return where (...) wanted keys stand among ascending ones, −1 where they do not."""
    at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return np.where(keys[at] == wanted, at, -1)


def missed_cells(tree: FacetTree, nodes: Nodes, surface: Floats, facets: Ints, level: float) -> Ints:
    """Return the cells (C, 3) in which a surface is not the level, and those around them that may hold it.

    surface (V, 3), facets (T, 3): as it was found.
    """
    grid = nodes.cells.grid
    middles = surface[facets].mean(axis=1)
    at_tips = _at_tips(surface, facets)
    across = np.concatenate([
        middles[~tree.within(middles, level * (1.0 + _ACROSS))],
        middles[at_tips][~tree.within(middles[at_tips], level * (1.0 + _OFF_TIP))],
    ])  # fmt: skip
    cells = np.concatenate([
        _between_nodes(tree, nodes, surface, level), np.floor((across - grid.low) / grid.step).astype(np.intp)
    ])  # fmt: skip
    around = np.unique((cells[:, None] + np.indices((3, 3, 3)).reshape(3, -1).T - 1).reshape(-1, 3), axis=0)
    known = indices(nodes.keys, grid.keys(around[:, None] + _CORNERS))
    around = around[(known >= 0).all(axis=1)]
    half = 0.5 * math.sqrt(3.0) * grid.step
    gap = tree.closest(grid.low + (around + 0.5) * grid.step, level + 1.01 * half)[0]
    return around[np.abs(gap - level) <= 1.001 * half]


def _at_tips(surface: Floats, facets: Ints) -> Ints:
    """Return the facets (n,) at the tips of steep pits of a surface; none at its borders."""
    around = np.bincount(facets.ravel(), corner_angles(surface, facets).ravel(), len(surface))
    tips = (around > 0.0) & (around < 2.0 * np.pi - _PIT)
    near = np.flatnonzero(tips[facets].any(axis=1))
    sides = np.stack([facets[near], np.roll(facets[near], -1, axis=1)], axis=-1).reshape(-1, 2)
    # Each side has its other facet, unless it is at a border.
    keys, other = sides @ [len(surface), 1], sides[:, ::-1] @ [len(surface), 1]
    alone = ~np.isin(keys, other) & tips[sides].any(axis=1)
    tips[sides[alone].ravel()] = False
    return near[tips[facets[near]].any(axis=1)]


def _between_nodes(tree: FacetTree, nodes: Nodes, surface: Floats, level: float) -> Ints:
    """Return the cells (C, 3) through which the level runs between the nodes.

    surface (V, 3): the vertices that were found. What is not near to them or to missed places near to them is the
    mirrored sheet within the part, or a cavity.
    """
    grid, none = nodes.cells.grid, np.empty((0, 3), dtype=np.intp)
    points = grid.points(nodes.keys[~nodes.outside])
    points = points[~tree.within(points, level - 0.5 * math.sqrt(3.0) * grid.step)]
    gap, away, _ = tree.closest(points)
    points = points + (level * (1.0 + _BEYOND) / np.where(gap > 0.0, gap, 1.0) - 1.0)[:, None] * away
    cells = np.floor((points - grid.low) / grid.step).astype(np.intp)
    # One or two corners rule out most cells, so that few distances are measured.
    for corner in grid.keys(_CORNERS):
        known = indices(nodes.keys, grid.keys(cells) + corner)
        hidden = (known >= 0) & ~nodes.outside[known]
        points, cells = points[hidden], cells[hidden]
    beyond = ~tree.within(points, level * (1.0 + 0.9 * _BEYOND))
    points, cells = points[beyond], cells[beyond]
    if not len(points) or not len(surface):
        return none
    own = KDTree(points)
    a, b = own.query_pairs(_LINK * level, output_type="ndarray").T
    piece = components(len(points), a, b)[1]
    near = nearest_points(KDTree(surface), points, distance_upper_bound=_LINK * level)[0] < np.inf
    return cells[np.isin(piece, piece[near])]


def divided(tree: FacetTree, nodes: Nodes, cells: Ints, parts: int, level: float) -> Nodes:
    """Return the nodes of a grid with the cells (C, 3) divided into `parts` along each axis, the new ones measured."""
    old = nodes.cells.grid
    grid = Grid(old.low, old.step / parts, parts * (old.shape - 1) + 1)
    coarse = grid.keys(parts * old.nodes(nodes.keys))
    within = np.indices((parts + 1,) * 3).reshape(3, -1).T
    fine = distinct(grid.keys(parts * cells)[:, None] + grid.keys(within))
    keys = distinct(np.concatenate([coarse, fine]))
    outside, whole, made = np.zeros((3, len(keys)), dtype=np.bool_)
    whole[np.searchsorted(keys, coarse)] = made[np.searchsorted(keys, fine)] = True
    outside[whole] = nodes.outside
    outside[~whole] = ~tree.within(grid.points(keys[~whole]), level)
    return Nodes(Cells(grid, parts, np.sort(grid.keys(parts * cells))), keys, outside, whole, made)
