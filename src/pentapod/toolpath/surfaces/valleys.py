"""Valleys: where a ball comes nearest to places of a region that it cannot touch, and touches what is not of it.

In a pocket narrower than itself it touches only the rims, at the end of a groove only the edges, which may be steeper
than the region. Where it lies there it still cuts more over the region than from any place on the region itself.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.topology import components
from pentapod.toolpath.surfaces.options import ValleyOptions


def valleys(
    mesh: Mesh,
    patch: Patch,
    own: Patch,
    radius: float,
    machined: Callable[[], Bools],
    covers: Callable[[Floats], Bools],
    options: ValleyOptions,
) -> Patch:
    """Return the facets of a ball's drive surface about its places nearest to what it does not touch of a region.

    patch: of the drive surface, from which the ball touches the region; own: the region on the part. radius: of the
    ball, metres. machined: tells at which vertices (V,) of the drive surface the ball may be; covers: over which points
    (N, 3) of the part the part itself lies.
    """
    wanted = np.zeros(len(mesh.vertices), dtype=np.bool_)
    count = min(own.areas.sum() / (options.apart * radius) ** 2 + 1.0, options.most)
    points, _ = own.spread(int(count))
    away = np.full(len(points), np.inf)
    wide = _wide(patch, options.fragment * radius)
    if wide.any():
        away = np.asarray(KDTree(patch.vertices[wide]).query(points)[0])
    least = options.nearer * radius
    missed = np.flatnonzero(away > radius + least)
    missed = missed[~covers(points[missed])]
    if len(missed):
        places = np.flatnonzero(machined())
        near, which = (np.asarray(found) for found in KDTree(mesh.vertices[places]).query(points[missed]))
        wanted[places[which[near < away[missed] - least]]] = True
    return Patch.whole(mesh).only(np.asarray(wanted[mesh.faces].any(axis=1)))


def _wide(patch: Patch, least: float) -> Bools:
    """Return the vertices (V,) of pieces of a patch wider than `least` metres: a narrower one holds no pass."""
    count, piece = components(len(patch.vertices), *patch.topology.edges.T)
    ends = np.full((2, count, 3), -np.inf)
    for end, side in zip(ends, (1.0, -1.0), strict=True):
        np.maximum.at(end, piece, side * patch.vertices)
    width: Floats = np.linalg.norm(ends.sum(axis=0), axis=1)
    return np.asarray(width[piece] > least)
