"""Map of the material that is left on the region, for reports: heights at points that are spread evenly over it."""

from __future__ import annotations

import numpy as np

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
    points, normals = region.spread(COUNT)
    far = OPTIONS.far * max(solid.largest_radius for solid in cutting.cutter)
    heights = np.full(len(points), far)
    for one in swept:
        one.entries(points, normals, heights)
    return MaterialLeft(points, heights, coverage.left, far)
