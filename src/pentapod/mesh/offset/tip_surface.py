"""Tip surface: the lowest places of the tip of a bull-nose or flat end whose axis is +z, as a mesh.

Over each place of the plane it is where a dropped cutter comes to rest; where that height jumps, it has an upright
wall. Nodes of a grid below the height are inside, so that dual contouring makes heights and walls one surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.errors import MeshError
from pentapod.geometry.runs import members
from pentapod.mesh.normals import unit_or_zero
from pentapod.mesh.offset.dual_contouring import Cells, Crossings, Grid, dual_contour
from pentapod.mesh.query.tree import FacetTree
from pentapod.numerics.threads import for_rows

MOST_NODES = 30_000_000
_SHIFT = np.array([0.3819660, 0.2679492, 0.4142136])
"""Shares of a step by which the grid is off the part, so that flat faces do not lie in its planes."""
_HALVINGS, _NEAR, _EXACT = 18, 0.5, 1e-6
"""Of edges, to find where the surface crosses them; how far and exactly vertices are moved onto it, in steps."""


@dataclass(frozen=True, eq=False)
class Lowered:
    """A cutter that is lowered onto a mesh along −z: all that is within `radius` of a disc of radius `disc`, and above.

    Metres. Places are those of the tip, `radius` below the disc.
    """

    tree: FacetTree
    radius: float
    disc: float

    @property
    def _hierarchy(self) -> tuple[Floats, Ints, Floats]:
        return self.tree.corners, self.tree.starts, self.tree.extents

    def heights(self, places: Floats) -> tuple[Floats, Floats]:
        """Return the lowest heights (N,) of the tip at places (N, 2), −inf for none, and unit normals (N, 3) there."""
        from pentapod.mesh.offset.tip_kernels import drop_normals  # noqa: PLC0415  loads numba

        heights, touches = self._dropped(places)
        normals = np.empty((len(places), 3))
        drop_normals(np.ascontiguousarray(places), heights, touches, normals)
        return heights - self.radius, normals

    def touched(self, places: Floats) -> Floats:
        """Return what (N, 3) the cutter touches that is lowered at places (N, 2); NaN where that is nothing."""
        return self._dropped(places)[1][:, :3]

    def _dropped(self, places: Floats) -> tuple[Floats, Floats]:
        from pentapod.mesh.offset.drop_kernels import drop_all  # noqa: PLC0415  loads numba

        heights, touches = np.empty(len(places)), np.full((len(places), 4), np.nan)
        given = (self.radius, self.disc, *self._hierarchy)
        for_rows(drop_all, (np.ascontiguousarray(places),), given, (heights, touches))
        return heights, touches

    def meets(self, tips: Floats) -> Bools:
        """Return at which tips (N, 3) the cutter, as high as the part, cuts into it."""
        from pentapod.mesh.offset.tip_kernels import all_met  # noqa: PLC0415  loads numba

        met = np.empty(len(tips), dtype=np.intp)
        for_rows(all_met, (self._raised(tips),), (self.radius, self.disc, *self._hierarchy), (met,))
        return met > 0

    def settled(self, tips: Floats, towards: Floats, reach: float, accuracy: float) -> tuple[Floats, Bools]:
        """Return tips (N, 3) moved along directions (N, 3), or back, to where they are just clear; which could be."""
        from pentapod.mesh.offset.tip_kernels import settle  # noqa: PLC0415  loads numba

        points, held = self._raised(tips), np.empty(len(tips), dtype=np.intp)
        given = (reach, accuracy, self.radius, self.disc, *self._hierarchy)
        for_rows(settle, (points, np.ascontiguousarray(towards)), given, (held,))
        return points - [0.0, 0.0, self.radius], held > 0

    def surface(self, step: float) -> tuple[Floats, Ints]:
        """Return vertices (V, 3) and triangles (T, 3), facing up and outwards, of the tip surface.

        It ends below the lowest point of the mesh. step: metres between the grid's nodes; a channel in which the cutter
        has less play may be closed. Raises MeshError where the grid would have more nodes than MOST_NODES.
        """
        extent, wide = self.tree.extents[0], self.radius + self.disc
        low = extent[0] - np.array([wide, wide, 0.0]) - (2.0 + _SHIFT) * step
        size = np.ceil((extent[1] + [wide, wide, 0.0] - low) / step).astype(np.intp) + 3
        grid = Grid(low, step, size)
        if size.prod() > 100 * MOST_NODES:
            raise _too_fine(self.tree, step)
        columns = np.indices(tuple(size[:2])).reshape(2, -1).T
        places = low[:2] + step * columns
        heights, normals = self.heights(places)
        top = np.floor((np.maximum(heights, low[2] - step) - low[2]) / step).astype(np.intp)
        nodes = _nodes(top.reshape(tuple(size[:2])), size)
        if nodes is None:
            raise _too_fine(self.tree, step)
        keys, outside = nodes
        crossings = self._crossings(grid, columns, top, heights, normals)
        vertices, triangles, _ = dual_contour(Cells(grid, 1, np.empty(0, dtype=np.intp)), keys, outside, crossings)
        normals = _vertex_normals(vertices, triangles)
        return self.settled(vertices, normals, _NEAR * step, _EXACT * step)[0], triangles

    def _crossings(self, grid: Grid, columns: Ints, top: Ints, heights: Floats, normals: Floats) -> Crossings:
        """Return where the surface crosses the grid's edges. top (C,): the highest node inside in each column."""
        from pentapod.mesh.offset.tip_kernels import cross_tips  # noqa: PLC0415  loads numba

        own = np.flatnonzero(top >= 0)
        nodes = np.column_stack([columns[own], top[own]])
        points = np.column_stack([grid.low[:2] + grid.step * columns[own], heights[own]])
        found = [(grid.keys(nodes), np.full(len(own), 2), np.zeros(len(own), dtype=np.bool_), points, normals[own])]
        across = tuple(grid.shape[:2])
        index = np.arange(len(columns)).reshape(across)
        for axis in range(2):
            a = index.take(range(across[axis] - 1), axis=axis).ravel()
            b = index.take(range(1, across[axis]), axis=axis).ravel()
            lower, higher = np.minimum(top[a], top[b]), np.maximum(top[a], top[b])
            # The lowest layer of nodes has no cells below it: there the surface ends.
            edge, number = members(np.maximum(higher - np.maximum(lower, 0), 0))
            level = np.maximum(lower, 0)[edge] + 1 + number
            first, out = a[edge], top[a][edge] < top[b][edge]
            keys = grid.keys(np.column_stack([columns[first], level]))
            starts = grid.low + grid.step * np.column_stack([columns[np.where(out, b[edge], first)], level])
            starts[:, 2] += self.radius
            axes = np.full(len(keys), axis)
            lengths = np.where(out, -grid.step, grid.step)
            points, sides = np.empty_like(starts), np.empty_like(starts)
            given = (_HALVINGS, self.radius, self.disc, *self._hierarchy)
            for_rows(cross_tips, (starts, axes, lengths), given, (points, sides))
            points[:, 2] -= self.radius
            found.append((keys, axes, out, points, sides))
        keys = np.concatenate([each[0] for each in found])
        return Crossings(
            keys,
            np.concatenate([each[1] for each in found]),
            np.ones(len(keys), dtype=np.intp),
            np.concatenate([each[2] for each in found]),
            np.concatenate([each[3] for each in found]),
            np.concatenate([each[4] for each in found]),
        )

    def _raised(self, tips: Floats) -> Floats:
        """Return the middles (N, 3) of the disc for tips (N, 3)."""
        return tips + np.array([0.0, 0.0, self.radius])


def _nodes(top: Ints, size: Ints) -> tuple[Ints, Bools] | None:
    """Return ascending keys of the nodes near the surface, and whether they are outside; None for too many.

    top: as in `_crossings`.
    """
    padded = np.pad(top, 1, mode="edge")
    around = np.stack([padded[i : i + top.shape[0], j : j + top.shape[1]] for i in range(3) for j in range(3)])
    first = np.maximum(around.min(axis=0), 0).ravel()
    last = np.minimum(around.max(axis=0) + 1, size[2] - 1).ravel()
    counts = np.where(around.max(axis=0).ravel() >= 0, last - first + 1, 0)
    if counts.sum() > MOST_NODES:
        return None
    column, number = members(counts)
    level = first[column] + number
    return column * size[2] + level, np.asarray(level > top.ravel()[column])


def _vertex_normals(vertices: Floats, triangles: Ints) -> Floats:
    """Return normals (V, 3) of vertices, the means of those of the triangles at them, unit."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normals = np.zeros_like(vertices)
    np.add.at(normals, triangles.ravel(), np.repeat(np.cross(b - a, c - a), 3, axis=0))
    return unit_or_zero(normals)


def _too_fine(tree: FacetTree, step: float) -> MeshError:
    """Return the error of a grid with too many nodes: most often the unit of the mesh is wrong."""
    width = 1e3 * float(np.ptp(tree.extents[0], axis=0).max())
    return MeshError(
        f"the tip surface is too fine for this part, which is {width:,.0f} mm wide", key="step", value=step,
        expected=f"at most {MOST_NODES:,} nodes",
        remedy="is the unit of the mesh right? If it is, take a larger tool, or less of the part",
    )  # fmt: skip
