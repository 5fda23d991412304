"""HeightField: ray casting along one view direction with a uniform grid; exact on the facets."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.directions import normalised, tangent_frame
from pentapod.geometry.runs import members
from pentapod.mesh.mesh import Mesh
from pentapod.numerics.threads import for_rows


@dataclass(frozen=True)
class HeightGridOptions:
    """facets_per_cell: on average. most_entries: of facets in cells; a coarser grid is made where there were more.

    margin: barycentric tolerance up to which a point beside a facet counts as on it. sideways: metres to both sides of
    a point at which `hides` looks. across: rays in each direction for areas.
    """

    facets_per_cell: float = 2.0
    most_entries: int = 20_000_000
    margin: float = 1e-9
    sideways: float = 1e-7
    across: int = 200


OPTIONS = HeightGridOptions()


class HeightField:
    """The topmost facet over any point of the plane across `view` (3,), a direction towards the tool."""

    def __init__(self, mesh: Mesh, view: Floats) -> None:
        self.mesh, self.view = mesh, normalised(view, "view")
        self._frame = np.stack([*tangent_frame(self.view), self.view])
        self._local = mesh.vertices @ self._frame.T
        corners = self._local[mesh.faces]
        self._doubled = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        # Facets parallel to the view cover nothing.
        self._seen = np.flatnonzero(np.abs(self._doubled) > 1e-9 * 2.0 * mesh.facet_areas)
        self._low = self._local[:, :2].min(axis=0)
        self._extent = np.maximum(np.ptp(self._local[:, :2], axis=0), 1e-9)

    @cached_property
    def _grid(self) -> tuple[Floats, Ints, Ints, Ints]:
        """Cell size (2,), cells (2,), where each cell's facets begin, and the facets of all cells."""
        flat = self._local[self.mesh.faces[self._seen]][:, :, :2] - self._low
        cells = max(1.0, len(self._seen) / OPTIONS.facets_per_cell)
        while True:
            size = np.sqrt(self._extent.prod() / cells)
            shape = np.clip(np.ceil(self._extent / size), 1, 4096).astype(np.intp)
            cell = self._extent / shape
            low = np.clip((flat.min(axis=1) / cell).astype(np.intp), 0, shape - 1)
            high = np.clip((flat.max(axis=1) / cell).astype(np.intp), 0, shape - 1)
            span = high - low + 1
            count = span.prod(axis=1)
            if count.sum() <= OPTIONS.most_entries or cells <= 1.0:
                break
            cells /= 4.0
        owner, number = members(count)
        x = low[owner, 0] + number // span[owner, 1]
        y = low[owner, 1] + number % span[owner, 1]
        key = x * shape[1] + y
        order = np.argsort(key, kind="stable")
        begins = np.searchsorted(key[order], np.arange(int(shape.prod()) + 1))
        return cell, shape, begins.astype(np.intp), self._seen[owner[order]]

    def topmost(self, points: Floats, margin: float = OPTIONS.margin) -> tuple[Floats, Floats, Floats]:
        """Return the topmost surface points (N, 3) on the view lines through points (N, 3), normals there, and heights.

        Heights (N,) are metres along the view from the origin; −inf, with NaN points and normals, where the line meets
        no facet. margin: barycentric tolerance up to which a point beside a facet counts as on it; where it is
        negative, only the interior of facets counts.
        """
        surface, normals = np.full((2, len(points), 3), np.nan)
        heights, facets, weights = self._topmost(points, margin)
        there = np.flatnonzero(facets >= 0)
        corners, weight = self.mesh.faces[facets[there]], weights[there][:, :, None]
        surface[there] = (weight * self.mesh.vertices[corners]).sum(axis=1)
        normals[there] = (weight * self.mesh.corner_normals[facets[there]]).sum(axis=1)
        return surface, normals, heights

    def above(self, points: Floats, heights: Floats) -> Bools:
        """Return whether the topmost surface on the view lines through points (N, 3) is above heights (N,), metres."""
        from pentapod.mesh.query.kernels.heightfield_kernels import any_above  # noqa: PLC0415  loads numba

        local, found = points @ self._frame.T, np.empty(len(points), dtype=np.bool_)
        given = self._grid[3], self._local, self.mesh.faces, self._doubled, OPTIONS.margin
        for_rows(any_above, (local, heights, *self._facets_near(local[:, :2])), given, (found,))
        return found

    def hides(self, points: Floats, slack: float) -> Bools:
        """Return whether the mesh lies above points (N, 3), along the view, by more than `slack` metres.

        Tested a little to either side, and true only if it is on both: a point at the foot of a wall is not hidden by
        it, a point under a seam between two facets is.
        """
        sideways = OPTIONS.sideways * (0.83 * self._frame[0] + 0.56 * self._frame[1])
        height = points @ self.view + slack
        return np.logical_and(*(self.above(points + side, height) for side in (sideways, -sideways)))

    def front_area(self) -> float:
        """Return about the area, square metres across the view, over which the mesh is seen from its front."""
        x, y = (self._low[k] + (np.arange(OPTIONS.across) + 0.5) / OPTIONS.across * self._extent[k] for k in range(2))
        points = np.stack([k.ravel() for k in np.meshgrid(x, y)], axis=1) @ self._frame[:2]
        facets = self._topmost(points, OPTIONS.margin)[1]
        front = self.mesh.facet_normals[facets[facets >= 0]] @ self.view > 0.0
        return float(front.sum() / len(points) * self._extent.prod())

    def _topmost(self, points: Floats, margin: float) -> tuple[Floats, Ints, Floats]:
        """Return heights (N,) as `topmost`, the facets (N,) there, −1 for none, and the weights (N, 3) on them."""
        from pentapod.mesh.query.kernels.heightfield_kernels import topmost_facets  # noqa: PLC0415  loads numba

        local, count = points @ self._frame.T, len(points)
        heights, facets, weights = np.empty(count), np.empty(count, dtype=np.intp), np.empty((count, 3))
        given = self._grid[3], self._local, self.mesh.faces, self._doubled, margin
        for_rows(topmost_facets, (local, *self._facets_near(local[:, :2])), given, (heights, facets, weights))
        return heights, facets, weights

    def _facets_near(self, points: Floats) -> tuple[Ints, Ints]:
        """Return where the facets of the points' cells begin in the grid's facets, and how many they are (N,)."""
        cell, shape, begins, _ = self._grid
        place = np.floor((points - self._low) / cell)
        # Points on the upper edge of the grid belong to the last cell.
        rim = (points - self._low <= self._extent * (1.0 + 1e-9)) & (place >= shape)
        index = np.where(rim, shape - 1, place)
        index = np.where((index < 0) & (points - self._low >= -1e-9 * self._extent), 0, index)
        inside = ((index >= 0) & (index < shape)).all(axis=1)
        key = np.where(inside, index[:, 0] * shape[1] + index[:, 1], 0).astype(np.intp)
        return begins[key], np.where(inside, begins[key + 1] - begins[key], 0)


def _cross(a: Floats, b: Floats) -> Floats:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
