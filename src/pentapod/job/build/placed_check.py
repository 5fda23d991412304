"""Placed toolpaths: where the tool, with the axes that were planned, would cut into the part or touch it on a rapid."""

from __future__ import annotations

import numpy as np

from pentapod.base.refusal import Shortfall
from pentapod.geometry.runs import marked_runs
from pentapod.mesh.query.swept_depth import TouchingBody, meets
from pentapod.planning import PlacedPath
from pentapod.planning.placement.placed_path import UnplacedPath
from pentapod.toolpath.toolpath import SegmentKind
from pentapod.verify import Cutting

Ranges = tuple[tuple[int, int], ...]


def meetings(placed: PlacedPath, cutting: Cutting, slack: float) -> Ranges:
    """Return the ranges of waypoints, inclusive, between which the tool meets the part with the planned axes.

    Cuts and links may be as deep as `cutting` says, rapids as deep as `slack`, metres. Motions between waypoints count.
    """
    toolpath, back = placed.toolpath, placed.placement.transform.inverse()
    tips, axes = back.apply(placed.tips), back.rotate(placed.axes)
    body = TouchingBody(cutting.solids, toolpath.tilt_centre)
    kinds = np.array([toolpath.segments[k].kind for k in toolpath.segment_of_interval])
    met = np.zeros(len(kinds), dtype=np.bool_)
    for rows, depth in ((kinds == SegmentKind.RAPID, slack), (kinds != SegmentKind.RAPID, cutting.depth)):
        own = np.flatnonzero(rows)
        pairs = (np.stack([poses[own], poses[own + 1]], axis=1).reshape(-1, 3) for poses in (tips, axes))
        met[own] = meets(cutting.surface.tree, body, *pairs, threshold=depth, every=2)
    return tuple((int(a), int(b)) for a, b in marked_runs(met).tolist())


def refusal_of(placed: PlacedPath, places: Ranges) -> UnplacedPath:
    """Return the refusal of a placed toolpath whose tool meets the part."""
    return UnplacedPath(
        "placement",
        "with the tool axes that the machine needs, cutter, shank or holder would cut into the part",
        (Shortfall("the tool touches the part", places, 0.0, "mm"),),
        attempt=placed,
    )
