"""Subdivision of a toolpath where its tool axis turns by more than a limit between two waypoints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pentapod.geometry.directions import angle_between, partway
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath


def stepped(toolpath: Toolpath, axis_step: float) -> Toolpath:
    """Return a toolpath whose axis turns by at most `axis_step` radians between waypoints.

    Inserted waypoints divide the turn evenly; the tilt centre (a ball's centre, the spot of a beam) moves straight from
    one waypoint to the next. A toolpath that keeps the step is returned unchanged.

    >>> fine = stepped(toolpath, np.radians(1.0))
    >>> len(fine) >= len(toolpath)
    True
    """
    segments = tuple(_subdivided(segment, toolpath.tilt_centre, axis_step) for segment in toolpath.segments)
    same = all(new is old for new, old in zip(segments, toolpath.segments, strict=True))
    return toolpath if same else replace(toolpath, segments=segments)


def fastest_turn(toolpath: Toolpath) -> float:
    """Return the largest turn of the axis on cuts, radians per metre of the tilt centre's path."""
    fastest = 0.0
    for segment in toolpath.segments:
        if segment.kind is SegmentKind.CUT:
            centres = segment.tips + toolpath.tilt_centre * segment.axes
            steps = np.linalg.norm(np.diff(centres, axis=0), axis=1)
            turn = angle_between(segment.axes[1:], segment.axes[:-1])
            fastest = max(fastest, float((turn / np.maximum(steps, 1e-9)).max()))
    return fastest


def _subdivided(segment: Segment, tilt_centre: float, axis_step: float) -> Segment:
    turn = angle_between(segment.axes[1:], segment.axes[:-1])
    # Rounding must not cost an additional waypoint.
    parts = np.maximum(np.ceil(turn / axis_step * (1.0 - 1e-9)), 1.0).astype(np.intp)
    if (parts == 1).all():
        return segment
    interval = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(interval)) - (np.cumsum(parts) - parts)[interval]) / parts[interval]
    axes = partway(segment.axes[interval], segment.axes[interval + 1], share)
    centres = segment.tips + tilt_centre * segment.axes
    between = (1.0 - share)[:, None] * centres[interval] + share[:, None] * centres[interval + 1]
    tips = np.where(share[:, None] > 0.0, between - tilt_centre * axes, segment.tips[interval])
    axes = np.where(share[:, None] > 0.0, axes, segment.axes[interval])
    return replace(
        segment, tips=np.concatenate([tips, segment.tips[-1:]]), axes=np.concatenate([axes, segment.axes[-1:]])
    )
