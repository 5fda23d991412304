"""Map of the material that is left on the region, for reports: heights at points that are spread evenly over it."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.mesh.patch import Patch
from pentapod.verify.replay.replay import Replay
from pentapod.verify.surface.surface_left import OPTIONS
from pentapod.verify.surface.swept_cutter import SweptSolid
from pentapod.verify.verdict.material_left import MaterialLeft

COUNT = 8192
"""Points of a map."""


def material_left(replay: Replay) -> MaterialLeft | None:
    """Return what the cutter leaves at points that are spread evenly over the region; None where that is not judged.

    After the claim: it has the swept volume.
    """
    cutting, swept = replay.specification.cutting, replay.kept.get(SweptSolid)
    if cutting is None or cutting.coverage is None or not cutting.cutter or not swept:
        return None
    coverage, piece = cutting.coverage, replay.program.provenance.piece
    region = (coverage if piece is None else coverage.of_piece(piece)).region
    if region is None:
        return None
    points, normals = _spread(region, COUNT)
    far = OPTIONS.far * max(solid.largest_radius for solid in cutting.cutter)
    heights = np.full(len(points), far)
    for one in swept:
        one.entries(points, normals, heights)
    return MaterialLeft(points, heights, coverage.left, far)


def _spread(region: Patch, count: int) -> tuple[Floats, Floats]:
    """Return points (count, 3) evenly by area over a region, and the normals (count, 3) of their facets."""
    edges = np.cumsum(region.areas)
    facets = np.searchsorted(edges, (np.arange(count) + 0.5) * edges[-1] / count)
    # Kronecker's sequence of the plastic number: pairs that fill the unit square evenly.
    pairs = np.mod((np.arange(count)[:, None] + 1.0) * [0.7548776662466927, 0.5698402909980532], 1.0)
    over = pairs.sum(axis=1) > 1.0
    pairs[over] = 1.0 - pairs[over]
    corners = region.vertices[region.faces[facets]]
    points = corners[:, 0] + (pairs[:, :, None] * (corners[:, 1:] - corners[:, :1])).sum(axis=1)
    return points, np.ascontiguousarray(region.facet_normals[facets])
