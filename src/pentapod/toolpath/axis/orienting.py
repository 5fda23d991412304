"""New tool axes for an existing toolpath."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import partway
from pentapod.geometry.polyline import arc_length
from pentapod.toolpath.axis.orientation import Orientation
from pentapod.toolpath.toolpath import SegmentKind, Toolpath


def oriented(toolpath: Toolpath, tool: Tool, orientation: Orientation) -> Toolpath:
    """Return a toolpath whose axes were the surface's normals with the axes of an orientation instead.

    Cuts meet the surface where they did. On links and rapids the axis goes evenly from the end of one cut to the
    start of the next, and the tip is carried along with the ends; before the first cut and after the last it stays.
    Raises ToolpathError as `Orientation.axes`.
    """
    cuts = [k for k, segment in enumerate(toolpath.segments) if segment.kind is SegmentKind.CUT]
    if orientation == Orientation() or not cuts:
        return toolpath
    # With the axis along the normal, every cutter's tip is its contact; a beam's lies the stand-off below.
    drop = min(tool.tilt_centre, 0.0)
    chosen = [toolpath.segments[k] for k in cuts]
    runs = [(segment.tips + drop * segment.axes, segment.axes) for segment in chosen]
    tips, axes = toolpath.tips.copy(), toolpath.axes.copy()
    known = np.zeros(len(tips), dtype=np.bool_)
    for k, run, new in zip(cuts, runs, orientation.axes(runs), strict=True):
        rows = slice(int(toolpath.starts[k]), int(toolpath.starts[k + 1]) + 1)
        tips[rows], axes[rows], known[rows] = tool.tips(*run, new), new, True
    _carry(toolpath.tips, tips, axes, known)
    segments = [
        replace(segment, tips=tips[a : b + 1], axes=axes[a : b + 1])
        for segment, (a, b) in zip(toolpath.segments, pairwise(toolpath.starts), strict=True)
    ]
    return replace(toolpath, segments=tuple(segments))


def _carry(old: Floats, tips: Floats, axes: Floats, known: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> None:
    """Fill the waypoints that are not known from those on either side, in place. old (N, 3): the tips before."""
    rows = np.flatnonzero(known)
    first, last = int(rows[0]), int(rows[-1])
    tips[:first] += tips[first] - old[first]
    tips[last + 1 :] += tips[last] - old[last]
    axes[:first], axes[last + 1 :] = axes[first], axes[last]
    for a, b in pairwise(rows):
        if b > a + 1:
            way = arc_length(old[a : b + 1])
            share = (way / way[-1])[1:-1] if way[-1] > 0.0 else np.full(b - a - 1, 0.5)
            tips[a + 1 : b] += np.outer(1.0 - share, tips[a] - old[a]) + np.outer(share, tips[b] - old[b])
            axes[a + 1 : b] = partway(axes[a], axes[b], share)
