"""Patch: the part of a surface to machine, with its normals; whole, trimmed to a region, or refined."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats, Ints, row_lengths
from pentapod.base.errors import ToolpathError
from pentapod.geometry.runs import members
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.normals import facet_cross, unit_or_zero
from pentapod.mesh.region import Region
from pentapod.mesh.topology import Topology
from pentapod.mesh.trimming import Root, compacted, linear_root, normal_root, trimmed
from pentapod.numerics.threads import nearest_points

MOST_FACETS = 8_000_000
"""Facets beyond which a patch is not refined."""

SAME_NORMAL = 1e-9
"""Difference of unit normals on both sides of an edge up to which it is no crease."""


@dataclass(frozen=True, eq=False)
class Patch:
    """Facets of a mesh, or pieces of them: the same surface with the same normals.

    vertices (V, 3): metres. faces (F, 3): vertex indices. normals (F, 3, 3): at the facets' corners, such that
    linear interpolation over a facet gives the surface's normal up to its length.
    """

    vertices: Floats
    faces: Ints
    normals: Floats

    @classmethod
    def whole(cls, mesh: Mesh) -> Patch:
        """Return all of a mesh."""
        patch = cls(mesh.vertices, mesh.faces, mesh.corner_normals)
        patch.__dict__["topology"] = mesh.topology  # known already: sorting a million edges takes a second
        return patch

    @classmethod
    def of(cls, mesh: Mesh, region: Region) -> Patch:
        """Return the part of a mesh within a region, cut exactly at its edges; empty where there is none."""
        return cls.whole(mesh).in_box(region).where_normals(region.faces)

    @cached_property
    def topology(self) -> Topology:
        """Which facets share which edges."""
        return Topology(self.faces, len(self.vertices))

    @cached_property
    def joins(self) -> Bools:
        """Whether (E,) exactly two facets meet at an edge, wound alike, and without a crease."""
        topology = self.topology
        joins = np.zeros(len(topology.edges), dtype=np.bool_)
        a, b = topology.side_pairs
        flat = self.normals.reshape(-1, 3)
        after_a, after_b = (side - side % 3 + (side + 1) % 3 for side in (a, b))
        same = np.abs(flat[a] - flat[after_b]).max(axis=1, initial=0.0) < SAME_NORMAL
        same &= np.abs(flat[after_a] - flat[b]).max(axis=1, initial=0.0) < SAME_NORMAL
        joins[topology.pair_edges] = topology.pair_agrees & same
        return joins

    def side_ends(self, sides: Ints) -> Ints:
        """Return the vertices (S, 2) at the ends of sides (S,); side 3 f + s runs from corner s of facet f to s + 1."""
        corners = self.faces.ravel()
        return np.stack([corners[sides], corners[sides - sides % 3 + (sides + 1) % 3]], axis=1)

    @cached_property
    def facet_normals(self) -> Floats:
        """Unit normals (F, 3) of the facets; zero for facets without area."""
        return unit_or_zero(facet_cross(self.vertices, self.faces))

    @cached_property
    def areas(self) -> Floats:
        """Areas (F,) of the facets, square metres."""
        return 0.5 * np.linalg.norm(facet_cross(self.vertices, self.faces), axis=1)

    def refined(self, longest: float) -> Patch:
        """Return the same surface in facets whose edges are no longer than `longest` metres.

        Edges are halved until they are short enough. Raises ToolpathError where that would take millions.
        """
        patch = self
        while len(patch.faces):
            sides = np.roll(patch.faces, -1, axis=1)
            long = row_lengths(patch.vertices[sides] - patch.vertices[patch.faces]) > longest
            if not long.any():
                break
            if len(patch.faces) + long.sum() > MOST_FACETS:
                raise ToolpathError(
                    "the stepover is too fine for this part",
                    key="stepover",
                    expected=f"at most {MOST_FACETS:,} facets with edges of {1e3 * longest:.3g} mm",
                    remedy="is the unit of the mesh right? If it is, take a larger stepover",
                )
            patch = patch._halved(long)
        return patch

    def rim(self, width: float, longest: float) -> tuple[Patch, Bools]:
        """Return the facets within 2 `width` metres of borders and creases, and which vertices (V,) are within `width`.

        Their edges are no longer than `longest` metres.
        """
        border = self.topology.edges[~self.joins]
        if not len(border):
            return Patch(self.vertices[:0], self.faces[:0], self.normals[:0]), np.zeros(0, dtype=np.bool_)
        start, along = self.vertices[border[:, 0]], self.vertices[border[:, 1]] - self.vertices[border[:, 0]]
        counts = np.ceil(row_lengths(along) / longest).astype(np.intp) + 1
        edge, number = members(counts)
        tree = KDTree(start[edge] + (number / np.maximum(counts - 1, 1)[edge])[:, None] * along[edge])
        # Drop distant facets and halve long edges in turns, so that distant facets are never refined.
        sides = self.vertices[np.roll(self.faces, -1, axis=1)] - self.vertices[self.faces]
        patch, size = self, max(float(row_lengths(sides).max()), longest)
        while True:
            patch = patch.refined(size)
            centres = patch.vertices[patch.faces].mean(axis=1)
            bound = 2.0 * width + size
            patch = patch.only(_nearer(tree, centres, bound))
            if size <= longest:
                break
            size = max(0.5 * size, longest)
        return patch, _nearer(tree, patch.vertices, width)

    def _halved(self, long: Bools) -> Patch:
        """Return the patch with the sides (F, 3) in `long` cut in the middle; neighbours agree on which."""
        topology, old = self.topology, len(self.vertices)
        edge = topology.edge_of_side
        split = np.zeros(len(topology.edges), dtype=np.bool_)
        split[edge[long]] = True
        number = old + np.cumsum(split) - 1
        a, b = topology.edges[split].T
        vertices = np.concatenate([self.vertices, 0.5 * (self.vertices[a] + self.vertices[b])])
        # Each facet's corners and middles, 0..5: corner k, middle of side k.
        index = np.concatenate([self.faces, number[edge]], axis=1)
        normals = np.concatenate([self.normals, 0.5 * (self.normals + np.roll(self.normals, -1, axis=1))], axis=1)
        marks = split[edge]
        faces, corner_normals = [], []
        for turn in range(3):
            for wanted, triangles in _CUTS.items():
                rows = np.flatnonzero((marks == np.roll(wanted, turn)).all(axis=1))
                if turn and wanted in ((False,) * 3, (True,) * 3):
                    continue
                turned = [tuple((k + turn) % 3 + (3 if k > 2 else 0) for k in t) for t in triangles]
                for triangle in turned:
                    faces.append(index[rows][:, triangle])
                    corner_normals.append(normals[rows][:, triangle])
        return Patch(vertices, np.concatenate(faces), np.concatenate(corner_normals))

    def steeper(self, upright: Floats, angle: float) -> Patch:
        """Return the part whose normals are more than `angle` radians from `upright` (3,) and from its opposite."""
        return self.where_normals(lambda n: np.cos(angle) * np.linalg.norm(n, axis=-1) - np.abs(n @ upright))

    def share_steeper(self, upright: Floats, angle: float) -> float:
        """Return the share of the area of facets whose normals are more than `angle` radians from `upright` (3,)."""
        steep = self.facet_normals @ upright < np.cos(angle)
        return float(self.areas[steep].sum() / self.areas.sum())

    def above(self, values: Floats, bound: float) -> tuple[Patch, Floats]:
        """Return the part where a quantity (V,) is at least `bound`, and the quantity at its vertices."""
        at = values[self.faces] - bound
        # The quantity is interpolated as a fourth coordinate.
        points = np.concatenate([self.vertices, values[:, None]], axis=1)
        vertices, faces, normals = trimmed(points, self.faces, self.normals, at, linear_root(at))
        return Patch(vertices[:, :3].copy(), faces, normals), vertices[:, 3].copy()

    def in_box(self, region: Region) -> Patch:
        """Return the part within the box of a region, cut exactly at its sides; all where it has none."""
        patch = self
        if region.box is not None:
            for axis in range(3):
                for bound, side in zip(region.bounds[:, axis], (1.0, -1.0), strict=True):
                    values = (side * (patch.vertices[:, axis] - float(bound)))[patch.faces]
                    patch = patch.trimmed(values, linear_root(values))
        return patch

    def only(self, facets: Bools) -> Patch:
        """Return the part that consists of the facets (F,) marked."""
        return Patch(*compacted(self.vertices, self.faces[facets]), self.normals[facets])

    def where_normals(self, quantity: Callable[[Floats], Floats]) -> Patch:
        """Return the part where a quantity of the normal, (..., 3) to (...), is not negative."""
        return self.trimmed(quantity(self.normals), normal_root(quantity, self.normals))

    def spread(self, count: int) -> tuple[Floats, Floats]:
        """Return points (count, 3) evenly by area over the surface, and the normals (count, 3) of their facets."""
        edges = np.cumsum(self.areas)
        facets = np.searchsorted(edges, (np.arange(count) + 0.5) * edges[-1] / count)
        # Kronecker's sequence of the plastic number: pairs that fill the unit square evenly.
        pairs = np.mod((np.arange(count)[:, None] + 1.0) * [0.7548776662466927, 0.5698402909980532], 1.0)
        over = pairs.sum(axis=1) > 1.0
        pairs[over] = 1.0 - pairs[over]
        corners = self.vertices[self.faces[facets]]
        points = corners[:, 0] + (pairs[:, :, None] * (corners[:, 1:] - corners[:, :1])).sum(axis=1)
        return points, np.ascontiguousarray(self.facet_normals[facets])

    def trimmed(self, values: Floats, root: Root) -> Patch:
        """Return the part where values (F, 3) at the corners of facets are not negative; root: where they are zero."""
        if (values >= 0.0).all():
            return self
        return Patch(*trimmed(self.vertices, self.faces, self.normals, values, root))


def _nearer(tree: KDTree, points: Floats, bound: float) -> Bools:
    """Return which points (N, 3) are nearer than `bound` metres to one of a tree.

    Points in small cubes are decided together where the middle of their cube is near enough, or far enough away. Among
    many points at about the same distance, as in the middle of a round border, single searches take long.
    """
    if not len(points):
        return np.zeros(0, dtype=np.bool_)
    side = 0.125 * bound
    cell = np.floor(points / side).astype(np.int64)
    cell -= cell.min(axis=0)
    _, first, cube = np.unique(
        np.ravel_multi_index(tuple(cell.T), cell.max(axis=0) + 1), return_index=True, return_inverse=True
    )
    middle, spread = (np.floor(points[first] / side) + 0.5) * side, (1.0 + 1e-9) * 0.5 * np.sqrt(3.0) * side
    away = np.asarray(nearest_points(tree, middle, distance_upper_bound=bound + spread)[0])
    found = (away + spread < bound)[cube]
    open_ = np.flatnonzero(~found & (away < np.inf)[cube])
    found[open_] = np.isfinite(np.asarray(nearest_points(tree, points[open_], distance_upper_bound=bound)[0]))
    return found


_A, _B, _C, _AB, _BC, _CA = range(6)
"""Corners of a facet, and the middles of its sides."""
_CUTS: dict[tuple[bool, bool, bool], tuple[tuple[int, int, int], ...]] = {
    (False, False, False): ((_A, _B, _C),),
    (True, False, False): ((_A, _AB, _C), (_AB, _B, _C)),
    (True, True, False): ((_AB, _B, _BC), (_A, _AB, _BC), (_A, _BC, _C)),
    (True, True, True): ((_A, _AB, _CA), (_AB, _B, _BC), (_CA, _BC, _C), (_AB, _BC, _CA)),
}
"""Triangles that a facet becomes, by which of its sides are halved."""
