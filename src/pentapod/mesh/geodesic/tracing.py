"""Geodesic tracing: straightest geodesics over a triangle mesh (Polthier and Schmies 1998), many rays at once.

A ray crosses each edge as if both facets were unfolded into one plane: the component of its direction along the edge is
kept, the one across it is rotated from the first facet's plane into the second's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.mesh.patch import Patch

SLOWEST_DECREASE = 1e-12
"""Per metre: a barycentric weight that decreases more slowly counts as constant."""


@dataclass(frozen=True, eq=False)
class SurfaceRays:
    """N places on a patch, each with a direction in its facet. weights (N, 3): barycentric in facets (N,).

    directions (N, 3): unit. landed (N,): false where the ray left the patch.
    """

    facets: Ints
    weights: Floats
    directions: Floats
    landed: Bools

    def points(self, patch: Patch) -> Floats:
        """Return the places (N, 3), metres."""
        return (self.weights[:, :, None] * patch.vertices[patch.faces[self.facets]]).sum(axis=1)


def neighbours(patch: Patch) -> Ints:
    """Return the facet (F, 3) on the other side of each facet's side, or −1 at borders."""
    other = np.full(3 * len(patch.faces), -1, dtype=np.intp)
    a, b = patch.topology.side_pairs
    agree = patch.topology.pair_agrees
    a, b = a[agree], b[agree]
    other[a], other[b] = b // 3, a // 3
    return other.reshape(-1, 3)


def traced(patch: Patch, adjacent: Ints, start: SurfaceRays, lengths: Floats) -> SurfaceRays:
    """Return the ends of rays of `lengths` (N,) metres over a patch. adjacent: its `neighbours`."""
    from pentapod.mesh.geodesic.tracing_kernels import trace  # noqa: PLC0415  loads numba

    facets, weights = start.facets.astype(np.intp), start.weights.astype(np.float64)
    directions, landed = start.directions.astype(np.float64), start.landed.astype(np.bool_)
    along = lengths.astype(np.float64)
    faces = patch.faces.astype(np.intp, copy=False)
    trace(
        patch.vertices,
        faces,
        patch.facet_normals,
        adjacent,
        along,
        SLOWEST_DECREASE,
        facets,
        weights,
        directions,
        landed,
    )
    return SurfaceRays(facets, weights, directions, landed)
