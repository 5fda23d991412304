"""Tight channels of a part: slots and bores as wide as the ball, or hardly wider.

The surface of the ball's centres has no width there, and would be closed.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.heightfield import HeightField
from pentapod.mesh.query.tree import FacetTree
from pentapod.mesh.region import Region
from pentapod.toolpath.surfaces.options import ChannelOptions


def has_tight_channels(
    part: Mesh, tree: FacetTree, radius: float, view: Floats, options: ChannelOptions, region: Region | None
) -> bool:
    """Return whether a part has channels hardly wider than the ball, in the box of a region if it has one.

    There the ball fits at its radius above the surface, and hardly farther away it touches the wall opposite. What the
    part hides does not count: among it are surfaces inside of parts that are made of several bodies.
    """
    whole = Patch.whole(part)
    patch = whole if region is None or region.box is None else whole.in_box(region)
    area = float(patch.areas.sum())
    if not area > 0.0:
        return False
    count = min(int(options.samples * area / radius**2) + 1, options.most)
    points, normals = patch.spread(count)
    fits = ~tree.within(points + radius * normals, (1.0 - options.fits) * radius)
    points, normals = points[fits], normals[fits]
    gap, away, _ = tree.closest(points + (1.0 + options.play) * radius * normals, radius)
    opposite = -np.einsum("ni,ni->n", away, normals)
    tight = np.flatnonzero((gap < radius) & (opposite > np.cos(options.parallel) * gap))
    if len(tight) <= options.share * count:
        return False
    hidden = HeightField(part, view).hides((points + radius * normals)[tight], options.above * radius)
    return len(tight) - int(hidden.sum()) > options.share * count
