"""Toolpath: tool tips and axes in the workpiece frame, as cuts, links and rapids; independent of the robot."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats, Ints, frozen, set_frozen
from pentapod.base.display import html_table, plot_axes
from pentapod.base.errors import ToolpathError
from pentapod.base.values import Value
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.rigid import RigidTransform
from pentapod.geometry.runs import run_starts

JOIN_TOLERANCE_M = 1e-9
"""Largest difference between the ends of neighbouring segments, metres and unit vectors."""
MOST_DRAWN = 800
"""Largest number of waypoints in a notebook's drawing."""


class SegmentKind(StrEnum):
    """Kind of motion: cut (process on), link (on feed, not cutting), rapid (clear of the part).

    >>> [kind.name for kind in SegmentKind]
    ['CUT', 'LINK', 'RAPID']
    """

    CUT = "cut"
    LINK = "link"
    RAPID = "rapid"


_STYLES = {SegmentKind.CUT: "-", SegmentKind.LINK: "--", SegmentKind.RAPID: ":"}


@dataclass(frozen=True, eq=False)
class Segment(Value):
    """Tool poses of one kind of motion.

    tips (N, 3): tool tips, metres, workpiece frame, N ≥ 2. axes (N, 3): unit, tip → spindle. feed: requested speed of
    the tip, m/s; infinite on rapids (the machine's rapid rate applies). power: share of full laser (or spindle) power
    while cutting, 0 to 1. dwell: at the segment's end, seconds; 0 for an exact stop, None for no stop. words: what the
    file that it was read from says before it: spindle, coolant, tool. Raises ToolpathError for too few poses, a wrong
    feed, power or dwell, or an axis that is not of unit length.

    >>> tips = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]])
    >>> cut = Segment(SegmentKind.CUT, tips, np.tile([0.0, 0.0, 1.0], (2, 1)), feed=0.025)
    >>> len(cut.tips)
    2
    """

    summary = ("kind",)

    kind: SegmentKind
    tips: Floats
    axes: Floats
    feed: float
    power: float = 1.0
    dwell: float | None = None
    words: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        tips, axes = frozen(self.tips, "tips", (None, 3)), frozen(self.axes, "axes", (None, 3))
        set_frozen(self, tips=tips, axes=axes, kind=SegmentKind(self.kind))
        if tips.ndim != 2 or tips.shape != axes.shape or len(tips) < 2:
            raise ToolpathError("a segment needs at least two poses", value=(tips.shape, axes.shape), expected="(N, 3)")
        lengths = np.linalg.norm(axes, axis=1)
        worst = int(np.abs(lengths - 1.0).argmax())
        if abs(lengths[worst] - 1.0) > 1e-9:
            what = f"tool axis {worst} is not of unit length"
            raise ToolpathError(what, key="axes", value=float(lengths[worst]), expected="1")
        if not self.feed > 0.0:
            raise ToolpathError(
                "the feed must be positive", key="feed", value=self.feed, expected="m/s, above 0; infinite on rapids"
            )
        if not 0.0 <= self.power <= 1.0:
            raise ToolpathError("power must be a share of full power", key="power", value=self.power, expected="0 to 1")
        if self.dwell is not None:
            _check_seconds("dwell", self.dwell)


@dataclass(frozen=True, eq=False)
class Toolpath(Value):
    """One continuous motion in the workpiece frame: each segment begins where the one before ends.

    tilt_centre: distance in metres from the tip along the axis to the point about which the tool may tilt without
    leaving the surface: the ball's radius for a ball cutter, −stand-off for a beam or spray (the spot on the surface),
    0 for a fixed tip. wait: dwell at the first waypoint, seconds. end_words: what the file says after the last segment;
    notes: sentences on how the file was read, for the report. Waypoints are the poses of all segments; the common pose
    of two segments counts once. Raises ToolpathError where two segments do not join, or for a wrong wait.

    >>> {segment.kind.name for segment in toolpath.segments} == {"CUT", "LINK", "RAPID"}
    True
    """

    summary = ("waypoints", "cut_length")

    segments: tuple[Segment, ...]
    tilt_centre: float = 0.0
    wait: float = 0.0
    end_words: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        set_frozen(self, segments=tuple(self.segments))
        if not self.segments:
            raise ToolpathError("the toolpath is empty", key="segments", expected="at least one")
        _check_seconds("wait", self.wait)
        for k, (a, b) in enumerate(zip(self.segments, self.segments[1:], strict=False)):
            gap = float(np.abs(a.tips[-1] - b.tips[0]).max() + np.abs(a.axes[-1] - b.axes[0]).max())
            if gap > JOIN_TOLERANCE_M:
                raise ToolpathError(f"segments {k} and {k + 1} do not join", value=gap, expected="the same pose")

    @cached_property
    def tips(self) -> Floats:
        """Tool tips of all waypoints (N, 3), metres, workpiece frame."""
        return self._joined("tips")

    @cached_property
    def axes(self) -> Floats:
        """Nominal tool axes of all waypoints (N, 3), unit, tip → spindle, workpiece frame."""
        return self._joined("axes")

    @cached_property
    def tilt_centres(self) -> Floats:
        """The points (N, 3) about which the axis may tilt: tips + tilt_centre · axes, metres."""
        return self.tips + self.tilt_centre * self.axes

    @cached_property
    def starts(self) -> Ints:
        """Index (S + 1,) of each segment's first waypoint, and of the last waypoint."""
        return run_starts([len(s.tips) - 1 for s in self.segments])

    @cached_property
    def segment_of_interval(self) -> Ints:
        """Index (N − 1,) of the segment to which the interval between waypoints k and k + 1 belongs."""
        return np.repeat(np.arange(len(self.segments)), np.diff(self.starts))

    @cached_property
    def dwells(self) -> tuple[float | None, ...]:
        """Dwell in seconds at each segment's first waypoint and at the end (S + 1); None: no stop."""
        return (self.wait or None, *(s.dwell for s in self.segments))

    def __len__(self) -> int:
        return int(self.starts[-1]) + 1

    @property
    def waypoints(self) -> int:
        """Number of waypoints."""
        return len(self)

    @property
    def cut_length(self) -> float:
        """Length of all cuts along the tip, metres."""
        return sum(float(arc_length(s.tips)[-1]) for s in self.segments if s.kind is SegmentKind.CUT)

    def plot(self, axes: Any = None) -> Any:
        """Draw the tip's path in millimetres into three-dimensional matplotlib axes, and return them.

        Cuts are solid, links dashed, rapids dotted. Raises InputError if matplotlib is not installed.
        """
        (drawn,) = plot_axes(axes, projection="3d")
        for kind, style in _STYLES.items():
            gap = np.full((1, 3), np.nan)
            parts = [part for s in self.segments if s.kind is kind for part in (1e3 * s.tips, gap)]
            if parts:
                drawn.plot(*np.concatenate(parts).T, style, label=str(kind), lw=1)
        drawn.set(xlabel="x, mm", ylabel="y, mm", zlabel="z, mm", aspect="equal")
        drawn.legend()
        return drawn

    def _repr_html_(self) -> str:
        """Return what notebooks show: number of segments, bounds, and the path seen from above."""
        kinds = [s.kind for s in self.segments]
        low, high = 1e3 * self.tips.min(axis=0), 1e3 * self.tips.max(axis=0)
        rows = (
            ("segments", ", ".join(f"{kinds.count(kind)} {kind}" for kind in SegmentKind if kind in kinds)),
            ("cut", f"{1e3 * self.cut_length:,.1f} mm"),
            ("x, y, z, mm", ", ".join(f"{a:.2f} to {b:.2f}" for a, b in zip(low, high, strict=True))),
        )
        return html_table(f"Toolpath: {len(self):,} waypoints", rows, more=_top_view(self.tips))

    def _joined(self, name: str) -> Floats:
        parts = [getattr(s, name) for s in self.segments]
        return frozen(np.concatenate([parts[0], *(p[1:] for p in parts[1:])]), name)

    def transformed(self, transform: RigidTransform) -> Toolpath:
        """Return the same motion after a rigid transform."""
        moved = (replace(s, tips=transform.apply(s.tips), axes=transform.rotate(s.axes)) for s in self.segments)
        return replace(self, segments=tuple(moved))

    def stopping(self, dwell: float) -> Toolpath:
        """Return the same motion with a dwell, seconds (0: an exact stop), wherever a cut ends without a stop."""
        kinds = [s.kind for s in self.segments]
        ends = [
            a is SegmentKind.CUT and b is not SegmentKind.CUT for a, b in zip(kinds, [*kinds[1:], None], strict=True)
        ]
        stopped = (
            replace(s, dwell=dwell) if end and s.dwell is None else s
            for s, end in zip(self.segments, ends, strict=True)
        )
        return replace(self, segments=tuple(stopped))


def _check_seconds(name: str, seconds: float) -> None:
    if not (math.isfinite(seconds) and seconds >= 0.0):
        raise ToolpathError("must be a time", key=name, value=seconds, expected="seconds, 0 or more")


def _top_view(tips: Floats) -> str:
    """Return a small drawing (SVG) of a path (N, 3), in the colour of the surrounding text."""
    points = tips[:: max(1, len(tips) // MOST_DRAWN), :2] - tips[:, :2].min(axis=0)
    points *= 180.0 / max(float(np.ptp(tips[:, :2], axis=0).max()), 1e-9)
    line = " ".join(f"{x:.1f},{180.0 - y:.1f}" for x, y in points)
    path = f'<polyline points="{line}" fill="none" stroke="currentColor" stroke-width="0.7"/>'
    return f'<svg width="190" height="190" viewBox="-5 -5 190 190">{path}</svg>'
