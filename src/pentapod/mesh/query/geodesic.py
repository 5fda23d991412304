"""Geodesic distance on a patch by fast marching (Kimmel and Sethian 1998), from vertices with given distances.

Exact for straight fronts on a plane; on a curved surface the error is proportional to the length of the edges. A
slowness, steps per metre, on each facet gives the distance in steps instead of metres.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.levels import gradients
from pentapod.mesh.query.slicing import LevelSet


def distances(patch: Patch, seeds: Floats, slowness: Floats | None = None) -> Floats:
    """Return the distances (V,) from seeds (V,): given distances at some vertices, infinite elsewhere.

    seeds: metres, or steps with a slowness (F,) in steps per metre of each facet.
    """
    from pentapod.mesh.query.geodesic_kernels import march  # noqa: PLC0415  numba is heavy

    sides = np.linalg.norm(patch.vertices[np.roll(patch.faces, -1, axis=1)] - patch.vertices[patch.faces], axis=2)
    sides = np.maximum(sides, 1e-300)
    if slowness is not None:
        sides = sides * slowness[:, None]
    order = np.argsort(patch.faces.ravel(), kind="stable")
    first = np.searchsorted(patch.faces.ravel()[order], np.arange(len(patch.vertices) + 1))
    distance = np.array(seeds, dtype=np.float64)
    faces = np.ascontiguousarray(patch.faces, dtype=np.intp)
    march(faces, np.ascontiguousarray(sides), first.astype(np.intp), (order // 3).astype(np.intp), distance)
    return distance


def border_vertices(patch: Patch) -> Bools:
    """Return which vertices (V,) lie on the patch's border."""
    border = np.zeros(len(patch.vertices), dtype=np.bool_)
    border[patch.topology.edges[patch.topology.facets_at_edge == 1]] = True
    return border


def seeds_at(patch: Patch, facets: Ints, points: Floats, slowness: Floats) -> Floats:
    """Return seeds (V,): the distance of corners of facets (N,) from points (N, 3) on them, times the slowness."""
    corners = patch.faces[facets]
    distance = np.linalg.norm(patch.vertices[corners] - points[:, None], axis=2) * slowness[facets][:, None]
    seeds = np.full(len(patch.vertices), np.inf)
    np.minimum.at(seeds, corners.ravel(), distance.ravel())
    return seeds


def seeds_along(level_set: LevelSet, slowness: Floats) -> Floats:
    """Return seeds (V,): the distance from level lines of the corners of the facets that they cross."""
    patch = level_set.patch
    bins = level_set.corner_bins
    low, high = bins.min(axis=1), bins.max(axis=1)
    crossed = np.flatnonzero(high > low)
    values = level_set.values[patch.faces]
    if level_set.turns is not None:
        values = values + level_set.turns
    slope = np.linalg.norm(gradients(patch, values), axis=1)[crossed]
    seeds = np.full(len(patch.vertices), np.inf)
    # The levels next to a corner's own value, as far as they cross the facet.
    for offset in (0, 1):
        level = np.clip(bins[crossed] + offset, low[crossed, None] + 1, high[crossed, None])
        distance = np.abs(values[crossed] - level_set.level_values(level)) / np.maximum(slope, 1e-300)[:, None]
        np.minimum.at(seeds, patch.faces[crossed].ravel(), (distance * slowness[crossed, None]).ravel())
    return seeds
