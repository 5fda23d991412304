"""Orientation: axis mode, lead, tilt and smoothing of the nominal tool axis along passes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key, check_fields
from pentapod.base.values import Value
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import eased, partway
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.runs import run_starts
from pentapod.toolpath.axis.modes import AxisMode, Normal, with_lead_and_tilt
from pentapod.toolpath.axis.smoothing import noise_tolerance, rate_limited, smoothed, tangents
from pentapod.toolpath.toolpath import SegmentKind, Toolpath

REACH_M = 7.5e-3
"""Distance over which axes are smoothed by default, and at least where the stepover says more, metres."""


@dataclass(frozen=True)
class Orientation(Value):
    """The nominal tool axis along the passes. mode: the direction from which lead and tilt are measured.

    smoothing: 0 for none, None where the noise of the axes decides (`noise_tolerance`). reach: None for REACH_M. rate:
    radians per metre, None for no limit. Raises ToolpathError for values out of range.

    >>> leaning = Orientation(mode=Fixed((0.0, 0.0, 1.0)), lead=np.radians(5))
    >>> toolpath = oriented(toolpath, tool, leaning)
    """

    mode: AxisMode = field(default_factory=Normal)
    lead: Annotated[float, Key("deg", "lead angle: to the front, along the feed", ge=-80.0, le=80.0)] = 0.0
    tilt: Annotated[float, Key("deg", "side tilt: to the left of the feed", name="side", ge=-80.0, le=80.0)] = 0.0
    smoothing: Annotated[
        float | None,
        Key(
            "deg",
            "largest angle by which smoothing may turn an axis; 0 for none; when left out, twelve times the noise of "
            "a scan's normals, and 0 for clean surfaces",
            ge=0.0,
            le=45.0,
        ),
    ] = None
    reach: Annotated[
        float | None,
        Key(
            "mm",
            "distance over which axes are smoothed, along and across; three stepovers, at least 7.5, when left out",
            name="smoothing_reach",
            gt=0.0,
        ),
    ] = None
    rate: Annotated[float | None, Key("deg_mm", "largest turn of the axis per mm of a cut", gt=0.0)] = None

    def __post_init__(self) -> None:
        check_fields(self, ToolpathError)

    def axes(self, runs: list[tuple[Floats, Floats]], radius: float = 0.0) -> list[Floats]:
        """Return unit axes (n, 3) for each run of contacts and unit normals (n, 3), in the order and sense of travel.

        radius: of a ball, metres. Where it lies in a groove its contact and the normal jump from one side to the other;
        its centre goes on, so axes are smoothed as a function of where the centre is. Raises ToolpathError if the mode
        does not determine an axis, or no smoothing keeps the rate.
        """
        if not runs:
            return []
        starts = run_starts([len(contacts) for contacts, _ in runs])
        contacts, normals = (np.concatenate([run[k] for run in runs]) for k in range(2))
        axes = self.mode.axes(contacts, normals)
        if self.lead or self.tilt:
            axes = with_lead_and_tilt(axes, tangents(contacts, starts), self.lead, self.tilt)
        reach, tolerance = REACH_M if self.reach is None else self.reach, self.smoothing
        places = contacts + radius * normals
        tolerance = noise_tolerance(places, axes, starts, reach) if tolerance is None else tolerance
        axes = smoothed(places, axes, reach, tolerance)
        parts = [axes[a:b] for a, b in pairwise(starts)]
        if self.rate is not None:
            parts = [rate_limited(c, part, self.rate) for (c, _), part in zip(runs, parts, strict=True)]
        return parts


def oriented(toolpath: Toolpath, tool: Tool, orientation: Orientation) -> Toolpath:
    """Return a toolpath with the axes of an orientation instead of the surface's normals.

    Cuts keep their contacts. On links and rapids the axis turns from the end of one cut to the start of the next, at
    rest at both ends; before the first cut and after the last it is constant. The tilt centre keeps its way there if
    the tool can tilt about it: a ball that is clear stays clear. Other tips move with the ends. Raises ToolpathError as
    `Orientation.axes`.

    >>> upright = oriented(toolpath, tool, Orientation(mode=Fixed((0.0, 0.0, 1.0))))
    >>> upright.axes[0].tolist()
    [0.0, 0.0, 1.0]
    """
    cuts = [k for k, segment in enumerate(toolpath.segments) if segment.kind is SegmentKind.CUT]
    if not cuts:
        return toolpath
    # With the axis along the normal, every cutter's tip is its contact; that of a stand-off tool is above it.
    drop = min(tool.tilt_centre, 0.0)
    chosen = [toolpath.segments[k] for k in cuts]
    runs = [(segment.tips + drop * segment.axes, segment.axes) for segment in chosen]
    found = orientation.axes(runs, max(tool.tilt_centre, 0.0))
    if all(np.array_equal(new, normals) for new, (_, normals) in zip(found, runs, strict=True)):
        return toolpath
    tips, axes = toolpath.tips.copy(), toolpath.axes.copy()
    known = np.zeros(len(tips), dtype=np.bool_)
    for k, run, new in zip(cuts, runs, found, strict=True):
        rows = slice(int(toolpath.starts[k]), int(toolpath.starts[k + 1]) + 1)
        tips[rows], axes[rows], known[rows] = tool.tips(*run, new), new, True
    _interpolate(toolpath.tips, tips, axes, known)
    if tool.can_tilt:
        free = ~known
        tips[free] = toolpath.tilt_centres[free] - toolpath.tilt_centre * axes[free]
    segments = [
        replace(segment, tips=tips[a : b + 1], axes=axes[a : b + 1])
        for segment, (a, b) in zip(toolpath.segments, pairwise(toolpath.starts), strict=True)
    ]
    return replace(toolpath, segments=tuple(segments))


def _interpolate(old: Floats, tips: Floats, axes: Floats, known: Bools) -> None:
    """Interpolate the waypoints between known (N,) ones, in place. old (N, 3): the tips before."""
    rows = np.flatnonzero(known)
    first, last = int(rows[0]), int(rows[-1])
    tips[:first] += tips[first] - old[first]
    tips[last + 1 :] += tips[last] - old[last]
    axes[:first], axes[last + 1 :] = axes[first], axes[last]
    for a, b in pairwise(rows):
        if b > a + 1:
            path = arc_length(old[a : b + 1])
            share = (path / path[-1])[1:-1] if path[-1] > 0.0 else np.full(b - a - 1, 0.5)
            tips[a + 1 : b] += np.outer(1.0 - share, tips[a] - old[a]) + np.outer(share, tips[b] - old[b])
            axes[a + 1 : b] = partway(axes[a], axes[b], eased(share))
