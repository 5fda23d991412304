"""Facet normals, and smooth corner normals that keep sharp creases.

A smooth normal is the mean of the facet normals around a vertex, weighted by the facets' angles there (Thürmer and
Wüthrich 1998), which does not depend on how a polygon is triangulated. A *crease* is an edge whose facets meet at more
than the crease angle. The facets around a vertex form groups that are connected without crossing a crease, and each
group has its own mean. So normals belong to facet corners and are interpolated within each facet.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints, row_lengths
from pentapod.mesh.topology import Topology, components

CHUNK = 500_000
"""Facets processed at once in steps that need much memory for each."""


def facet_cross(vertices: Floats, faces: Ints) -> Floats:
    """Return twice the area vector (F, 3) of each facet, square metres, right-handed with its winding."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def unit_or_zero(vectors: Floats) -> Floats:
    """Return vectors (..., 3) scaled to unit length; zero vectors stay zero."""
    length = row_lengths(vectors)[..., None]
    return vectors / np.where(length > 0.0, length, 1.0)


def corner_angles(vertices: Floats, faces: Ints) -> Floats:
    """Return the angle (F, 3) in radians of each facet at each of its corners."""
    angles = np.empty((len(faces), 3))
    for first in range(0, len(faces), CHUNK):
        part = faces[first : first + CHUNK]
        sides = unit_or_zero(vertices[np.roll(part, -1, axis=1)] - vertices[part])
        back = -np.roll(sides, 1, axis=1)
        difference, total = (row_lengths(v) for v in (sides - back, sides + back))
        angles[first : first + CHUNK] = 2.0 * np.arctan2(difference, total)
    return angles


def smooth_pairs(topology: Topology, facet_normals: Floats, crease_angle: float) -> Bools:
    """Return whether (M,) the facets of each of `topology.side_pairs` are wound alike and meet without a crease."""
    a, b = (side // 3 for side in topology.side_pairs)
    cosine = (facet_normals[a] * facet_normals[b]).sum(axis=1)
    return topology.pair_agrees & (cosine >= np.cos(crease_angle))


def corner_normals(vertices: Floats, topology: Topology, normals: Floats, smooth: Bools) -> Floats:
    """Return unit normals (F, 3, 3) at the facets' corners, smooth across the pairs marked in `smooth`.

    They are means of `normals`: of the facets (F, 3), or of their corners (F, 3, 3).
    """
    faces, count = topology.faces, 3 * len(topology.faces)
    a, b = (side[smooth] for side in topology.side_pairs)
    # The pair's facets run along the edge in opposite senses: one's first corner is the other's second.
    after_a, after_b = (side - side % 3 + (side + 1) % 3 for side in (a, b))
    number, group = components(count, np.concatenate([a, after_a]), np.concatenate([after_b, b]))
    return _grouped_means(vertices, faces, normals, group, number)


def vertex_normals(vertices: Floats, faces: Ints, facet_normals: Floats) -> Floats:
    """Return unit normals (V, 3) at the vertices, averaged over all facets there, creases or not."""
    normals = np.zeros_like(vertices)
    normals[faces.ravel()] = _grouped_means(vertices, faces, facet_normals, faces.ravel(), len(vertices)).reshape(-1, 3)
    return normals


def _grouped_means(vertices: Floats, faces: Ints, normals: Floats, group: Ints, number: int) -> Floats:
    """Return the angle-weighted mean normal (F, 3, 3) of each corner's group (3F,), of unit length.

    normals: of the facets (F, 3), or of their corners (F, 3, 3).
    """
    weights = corner_angles(vertices, faces).ravel()
    own = np.repeat(normals, 3, axis=0) if normals.ndim == 2 else normals.reshape(-1, 3)
    total = np.zeros((number, 3))
    for k in range(3):
        total[:, k] = np.bincount(group, weights=weights * own[:, k], minlength=number)
    # Where the normals around a vertex cancel, each corner keeps its own.
    length = np.linalg.norm(total, axis=1)
    scale = np.bincount(group, weights=weights, minlength=number)
    cancelled = (length <= 1e-9 * scale)[group]
    means = np.where(cancelled[:, None], own, unit_or_zero(total)[group])
    return means.reshape(-1, 3, 3)
