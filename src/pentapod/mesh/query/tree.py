"""FacetTree: bounding-volume hierarchy of oriented boxes over the facets of a mesh.

Facets are halved at the median of their centres along the longest side, again and again. The tree is complete, so that
node k has the children 2k + 1 and 2k + 2 without pointers. Each box is aligned with the mean normal of its facets: over
a smooth surface it is thin, so that few boxes reach a tool that touches the surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints, read_only
from pentapod.mesh.mesh import Mesh
from pentapod.numerics.threads import for_rows

FACETS_PER_LEAF = 2
"""Smallest mean number of facets in a leaf; the mean is below twice that. Few make the tree large, many slow leaves."""

MORTON_BITS = 20
"""Bits of each coordinate along the Morton curve; three times as many must fit into 64."""


@dataclass(frozen=True, eq=False)
class FacetTree:
    """Boxes and facets. corners (F, 3, 3): of the facets in tree order, metres. facets (F,): their indices in the mesh.

    boxes (2 L − 1, 15): centre, half sizes and the three axes of each node, the L leaves last. starts (L + 1,):
    where each leaf's facets begin.
    """

    corners: Floats
    facets: Ints
    boxes: Floats
    starts: Ints

    @classmethod
    def of(cls, mesh: Mesh) -> FacetTree:
        """Return the tree of a mesh's facets, made once for each mesh."""
        if (known := _MADE.get(mesh)) is not None:
            return known
        from pentapod.mesh.query.kernels.box_kernels import fit_boxes, split_by_medians  # noqa: PLC0415 - loads numba

        order = np.arange(len(mesh.faces), dtype=np.intp)
        leaves = 1 << max(0, (len(order) // FACETS_PER_LEAF).bit_length() - 1)
        starts = (np.arange(leaves + 1) * len(order)) // leaves
        split_by_medians(mesh.vertices[mesh.faces].mean(axis=1), starts, order)
        corners = np.ascontiguousarray(mesh.vertices[mesh.faces[order]])
        boxes = np.empty((2 * leaves - 1, 15))
        fit_boxes(corners, starts, boxes)
        _MADE[mesh] = cls(corners, order, boxes, starts)
        return _MADE[mesh]

    @cached_property
    def extents(self) -> Floats:
        """Lowest and highest coordinates (2 L − 1, 2, 3) of each node: the boxes that points search."""
        from pentapod.mesh.query.kernels.box_kernels import fit_extents  # noqa: PLC0415 - loads numba

        extents = np.empty((len(self.boxes), 2, 3))
        fit_extents(self.corners, self.starts, extents)
        return extents

    def closest(self, points: Floats, within: float = np.inf) -> tuple[Floats, Floats, Ints]:
        """Return distances (M,) of points (M, 3), vectors (M, 3) from the mesh to them, and facets (M,) in tree order.

        What is no nearer than `within` metres counts as that far, with the facet −1.
        """
        from pentapod.mesh.query.kernels.segment_kernels import closest_of_all  # noqa: PLC0415 - loads numba

        distances, away = np.empty(len(points)), np.empty((len(points), 3))
        facets = np.empty(len(points), dtype=np.intp)
        given = (within, self.corners, self.starts, self.extents)
        for_rows(closest_of_all, (read_only(points),), given, (distances, away, facets))
        return distances, away, facets

    def within(self, points: Floats, distance: float) -> Bools:
        """Return which points (M, 3) are nearer to the mesh than `distance` metres."""
        from pentapod.mesh.query.kernels.segment_kernels import all_within  # noqa: PLC0415 - loads numba

        found = np.empty(len(points), dtype=np.bool_)
        given = (distance, self.corners, self.starts, self.extents)
        for_rows(all_within, (np.ascontiguousarray(points),), given, (found,))
        return found

    def clear(self, starts: Floats, ends: Floats, least: float) -> Bools:
        """Return which chords (M,) are nowhere nearer to the mesh than `least` metres."""
        from pentapod.mesh.query.kernels.segment_kernels import all_clear  # noqa: PLC0415 - loads numba

        clear = np.empty(len(starts), dtype=np.bool_)
        for_rows(all_clear, (starts, ends - starts), (self.corners, self.boxes, self.starts, least), (clear,))
        return clear


def along_morton_curve(points: Floats, bounds: Floats) -> Ints:
    """Return the order (N,) along a Morton curve of points (N, 3) within bounds (2, 3); neighbours in it are close."""
    low, high = bounds
    extent = float((high - low).max()) or 1.0
    cells = ((points - low) * ((2**MORTON_BITS - 1) / extent)).astype(np.int64)
    return np.argsort(_spread(cells[:, 0]) | _spread(cells[:, 1]) << 1 | _spread(cells[:, 2]) << 2, kind="stable")


def _spread(numbers: Ints) -> Ints:
    """Return the low 21 bits of each number with two empty bits after each."""
    x = numbers & 0x1FFFFF
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        x = (x | x << shift) & mask
    return x


_MADE: WeakKeyDictionary[Mesh, FacetTree] = WeakKeyDictionary()
"""A million facets take more than a second; toolpath, planner, verdict and report ask for the tree of one mesh."""
