"""Partition of a toolpath into pieces for several set-ups, each with its own approach and retract."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from pentapod.base.arrays import Bools, Ints
from pentapod.base.errors import ToolpathError
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.runs import marked_runs
from pentapod.toolpath.linking.links import LinkStyle, connection
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

Corner = tuple[float, float, float]


@dataclass(frozen=True)
class Piece:
    """Cuts of a toolpath: those between two waypoints, first and last, whose middles are within a box.

    low, high: the box's corners, metres, workpiece frame; points on the high sides are outside. Raises ToolpathError
    for a piece that can hold no cut.
    """

    first: int
    last: int
    low: Corner = (-np.inf, -np.inf, -np.inf)
    high: Corner = (np.inf, np.inf, np.inf)

    def __post_init__(self) -> None:
        if not (0 <= self.first < self.last and all(a < b for a, b in zip(self.low, self.high, strict=True))):
            raise ToolpathError("no such piece", value=(self.first, self.last, self.low, self.high))

    @property
    def is_boxed(self) -> bool:
        """Whether a box bounds the piece."""
        return bool(np.isfinite([*self.low, *self.high]).any())

    def __str__(self) -> str:
        """Return the piece in words: "x up to 12.5 mm, y 0 to 30 mm", or its waypoints."""
        if not self.is_boxed:
            return f"waypoints {self.first} to {self.last}"
        bounds = [_bound(name, a, b) for name, a, b in zip("xyz", self.low, self.high, strict=True)]
        return ", ".join(bound for bound in bounds if bound)

    def cuts(self, toolpath: Toolpath) -> Bools:
        """Return which intervals (N − 1,) between waypoints are cuts of this piece."""
        middles = 0.5 * (toolpath.tips[:-1] + toolpath.tips[1:])
        within: Bools = np.all((middles >= self.low) & (middles < self.high), axis=1)
        within[: self.first] = within[self.last :] = False
        return np.asarray(cutting_intervals(toolpath) & within, dtype=np.bool_)


def _bound(name: str, low: float, high: float) -> str:
    """Return one direction's bounds in words; nothing where there are none."""
    if np.isfinite(low) and np.isfinite(high):
        return f"{name} {1e3 * low:.6g} to {1e3 * high:.6g} mm"
    if np.isfinite(high):
        return f"{name} up to {1e3 * high:.6g} mm"
    return f"{name} from {1e3 * low:.6g} mm" if np.isfinite(low) else ""


def cutting_intervals(toolpath: Toolpath) -> Bools:
    """Return which intervals (N − 1,) between waypoints are cuts."""
    cutting = np.array([segment.kind is SegmentKind.CUT for segment in toolpath.segments])
    return np.asarray(cutting[toolpath.segment_of_interval], dtype=np.bool_)


def missed_cuts(toolpath: Toolpath, pieces: Sequence[Piece]) -> tuple[int, int]:
    """Return the number of intervals that are cuts, and of those that are in no piece or in more than one."""
    times, cutting = np.sum([piece.cuts(toolpath) for piece in pieces], axis=0), cutting_intervals(toolpath)
    return int(cutting.sum()), int((times != cutting).sum())


def pass_ends(toolpath: Toolpath) -> Ints:
    """Return the waypoint (P,) at which each pass ends: the last of each run of cutting intervals."""
    return marked_runs(cutting_intervals(toolpath))[:, 1]


def part_of(toolpath: Toolpath, piece: Piece, style: LinkStyle) -> Toolpath:
    """Return the motion that makes the cuts of a piece, in their order, linked as by `with_cuts`.

    Raises ToolpathError where the piece holds no cut.
    """
    chosen = piece.cuts(toolpath)
    if not chosen.any():
        raise ToolpathError("there is no cut in this piece", value=str(piece))
    return with_cuts(toolpath, chosen, style)


def without_cuts(toolpath: Toolpath, left_out: Sequence[tuple[int, int]], style: LinkStyle) -> Toolpath:
    """Return a toolpath without its cuts between pairs of waypoints, linked as by `with_cuts`.

    Raises ToolpathError where no cut is left.
    """
    chosen = cutting_intervals(toolpath)
    for first, last in left_out:
        chosen[first:last] = False
    if not chosen.any():
        raise ToolpathError("no cut is left", value=f"{len(left_out)} stretches are left out")
    return with_cuts(toolpath, chosen, style)


def share_left_out(toolpath: Toolpath, left_out: Sequence[tuple[int, int]]) -> float:
    """Return the share of the length of all cuts that lies between pairs of waypoints."""
    length = np.where(cutting_intervals(toolpath), np.diff(arc_length(toolpath.tilt_centres)), 0.0)
    marked = np.zeros(len(length), dtype=np.bool_)
    for first, last in left_out:
        marked[first:last] = True
    return float(length[marked].sum() / length.sum())


def with_cuts(toolpath: Toolpath, chosen: Bools, style: LinkStyle) -> Toolpath:
    """Return the motion that makes the chosen cuts, of intervals (N − 1,) between waypoints, in their order.

    Links between cuts that follow each other in the whole, before its first cut and after its last, are those of the
    whole. Where cuts are left out, the tool retracts, crosses at the clearance level and comes down as `style` says.
    """
    cutting = cutting_intervals(toolpath)
    begins, ends = marked_runs(chosen).T.tolist()
    tips, axes = toolpath.tips, toolpath.axes
    segments: list[Segment] = []
    # From waypoint a, where a run of cuts ends, to waypoint b, where the next begins; then that run.
    first, last = 0, len(toolpath) - 1
    for a, b, stop in zip([first, *ends], [*begins, last], [*ends, last], strict=True):
        if cutting[a:b].any():
            before = None if a == first else (tips[a - 1 : a + 1], axes[a - 1 : a + 1])
            after = None if b == last else (tips[b : b + 2], axes[b : b + 2])
            segments += connection(before, after, style)
        else:
            segments += stretch(toolpath, a, b)
        segments += stretch(toolpath, b, stop)
    return replace(toolpath, segments=tuple(segments))


def stretch(toolpath: Toolpath, a: int, b: int) -> list[Segment]:
    """Return the segments of a toolpath from waypoint a to waypoint b."""
    found: list[Segment] = []
    for segment, (start, end) in zip(toolpath.segments, pairwise(toolpath.starts.tolist()), strict=True):
        low, high = max(a, start) - start, min(b, end) - start
        if high > low:
            tips, axes = segment.tips[low : high + 1], segment.axes[low : high + 1]
            found.append(replace(segment, tips=tips, axes=axes, dwell=segment.dwell if high == end - start else None))
    return found
