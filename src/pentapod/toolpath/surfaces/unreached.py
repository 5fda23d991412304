"""Places of a region that a ball cannot touch, and where on its drive surface it comes nearest to them.

Over a pocket narrower than itself the ball rests on the rims, which may be steeper than the region, or beyond its box.
It touches nothing of the region there, but it leaves less over the floor than from any place at which it touches the
region.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats
from pentapod.geometry.runs import distinct
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.numerics.threads import nearest_points
from pentapod.toolpath.surfaces.options import UnreachedOptions


def nearest_to_unreached(
    mesh: Mesh,
    patch: Patch,
    own: Patch,
    radius: float,
    machined: Callable[[], Bools],
    covers: Callable[[Floats], Bools],
    options: UnreachedOptions,
) -> Patch:
    """Return the facets of a ball's drive surface from which it comes nearest to places that it does not touch.

    patch: the part of the drive surface from which the ball touches the region. own: the region on the part itself.
    radius: of the ball, metres. machined: returns at which vertices (V,) of the drive surface the ball may be. covers:
    returns for points (N, 3) of the part whether the part lies above them.
    """
    wanted = np.zeros(len(mesh.vertices), dtype=np.bool_)
    count = min(own.areas.sum() / (options.apart * radius) ** 2 + 1.0, options.most)
    points, _ = own.spread(int(count))
    away = np.full(len(points), np.inf)
    wide = ~patch.topology.small_bodies(patch.vertices, options.fragment * radius)
    if wide.any():
        away = np.asarray(nearest_points(KDTree(patch.vertices[distinct(patch.faces[wide])]), points)[0])
    least = options.nearer * radius
    missed = np.flatnonzero(away > radius + least)
    missed = missed[~covers(points[missed])]
    if len(missed):
        places = np.flatnonzero(machined())
        near, which = (np.asarray(found) for found in nearest_points(KDTree(mesh.vertices[places]), points[missed]))
        wanted[places[which[near < away[missed] - least]]] = True
    return Patch.whole(mesh).only(np.asarray(wanted[mesh.faces].any(axis=1)))
