"""Steep and shallow areas of a surface, seen along the view; narrow ones go with what is around them."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.mesh.patch import Patch
from pentapod.mesh.topology import components


def steep_facets(patch: Patch, view: Floats, angle: float, narrow: float) -> Bools:
    """Return which facets (F,) of a patch are in steep areas: their normals more than `angle` radians from `view` (3,).

    Areas narrower than `narrow` metres, first steep ones, then others, count as what is around them. The width of a
    strip is about twice its area by the length of its border with other areas.
    """
    steep = patch.facet_normals @ view < np.cos(angle)
    a, b = (side // 3 for side in patch.topology.side_pairs)
    start, end = patch.vertices[patch.topology.edges[patch.topology.pair_edges]].transpose(1, 0, 2)
    length = np.linalg.norm(end - start, axis=1)
    for kind in (True, False):
        same = steep[a] == steep[b]
        count, of_facet = components(len(patch.faces), a[same], b[same])
        area = np.bincount(of_facet, weights=patch.areas, minlength=count)
        border = sum(np.bincount(of_facet[side[~same]], weights=length[~same], minlength=count) for side in (a, b))
        steep = steep ^ ((2.0 * area < narrow * border)[of_facet] & (steep == kind))
    return steep
