"""Parting: contiguous parts of a toolpath, each a toolpath that comes to the work and leaves it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.arrays import Floats, Ints
from pentapod.errors import ToolpathError
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath


@dataclass(frozen=True)
class Parting:
    """How a part begins and ends on the surface: a straight stretch along the axis, metres, at a feed, m/s."""

    approach: float
    feed: float


def pass_ends(toolpath: Toolpath) -> Ints:
    """Return the waypoint (P,) at which each pass ends: the last of each run of cutting segments."""
    cutting = np.array([segment.kind is SegmentKind.CUT for segment in toolpath.segments])
    last = cutting & ~np.append(cutting[1:], False)
    return toolpath.starts[1:][last]


def part_of(toolpath: Toolpath, first: int, last: int, parting: Parting) -> Toolpath:
    """Return the motion from waypoint `first` to waypoint `last`, with what it takes to begin and end it.

    What leads to the first cut from elsewhere is left out, and what leads on from the last one, but for the path's own
    beginning and end. Raises ToolpathError where no cut lies between the waypoints.
    """
    if not 0 <= first < last < len(toolpath):
        raise ToolpathError("no such part", value=(first, last), expected=f"0 ≤ first < last < {len(toolpath)}")
    segments = [
        Segment(segment.kind, segment.tips[a : b + 1], segment.axes[a : b + 1], segment.feed)
        for segment, start, end in zip(toolpath.segments, toolpath.starts[:-1], toolpath.starts[1:], strict=True)
        for a, b in [(max(first - int(start), 0), min(last, int(end)) - int(start))]
        if b > a
    ]
    cuts = [k for k, segment in enumerate(segments) if segment.kind is SegmentKind.CUT]
    if not cuts:
        raise ToolpathError("there is no cut in this part", value=(first, last))
    lead, tail = segments[: cuts[0]], segments[cuts[-1] + 1 :]
    if first > 0:
        lead = [_straight(segments[cuts[0]], 0, parting)]
    if last < len(toolpath) - 1:
        tail = [_straight(segments[cuts[-1]], -1, parting)]
    return Toolpath((*lead, *segments[cuts[0] : cuts[-1] + 1], *tail), toolpath.pivot)


def _straight(cut: Segment, end: int, parting: Parting) -> Segment:
    """Return the approach to a cut's beginning (end 0), or the retract from its end (end −1), along the axis."""
    tip, axis = cut.tips[end], cut.axes[end]
    away: Floats = tip + parting.approach * axis
    tips = np.stack([away, tip] if end == 0 else [tip, away])
    return Segment(SegmentKind.LINK, tips, np.tile(axis, (2, 1)), parting.feed)
