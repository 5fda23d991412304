"""Partition of a toolpath into pieces, each with its own approach and retract."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Bools, Ints
from pentapod.base.errors import ToolpathError
from pentapod.geometry.runs import marked_runs
from pentapod.toolpath.linking import links
from pentapod.toolpath.linking.links import LinkStyle
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

Corner = tuple[float, float, float]


@dataclass(frozen=True)
class Piece:
    """Which cuts of a toolpath: those between two waypoints, first and last, whose middles are within a box.

    low, high: the box's corners, metres, workpiece frame; what is on the high sides is outside. Raises ToolpathError
    for a piece that can hold nothing.
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
    """Return how many intervals of a toolpath are cuts, and how many of them are in no piece or in more than one."""
    times, cutting = np.sum([piece.cuts(toolpath) for piece in pieces], axis=0), cutting_intervals(toolpath)
    return int(cutting.sum()), int((times != cutting).sum())


def pass_ends(toolpath: Toolpath) -> Ints:
    """Return the waypoint (P,) at which each pass ends: the last of each run of cutting intervals."""
    return marked_runs(cutting_intervals(toolpath))[:, 1]


def part_of(toolpath: Toolpath, piece: Piece, style: LinkStyle) -> Toolpath:
    """Return the motion that makes the cuts of a piece, in their order.

    Between cuts that follow each other in the whole, and before its first and after its last, the ways are those of the
    whole; where cuts are left out the tool retracts, crosses at the clearance level and comes down as `style` says.
    Raises ToolpathError where the piece holds no cut.
    """
    chosen = piece.cuts(toolpath)
    if not chosen.any():
        raise ToolpathError("there is no cut in this piece", value=str(piece))
    return _Partition(toolpath, style).toolpath(marked_runs(chosen).tolist())


class _Partition:
    def __init__(self, toolpath: Toolpath, style: LinkStyle) -> None:
        self.whole, self.style, self.cutting = toolpath, style, cutting_intervals(toolpath)

    def toolpath(self, runs: list[list[int]]) -> Toolpath:
        """Return what is made of runs of intervals, of which a run's end is its last waypoint."""
        last = len(self.whole) - 1
        segments = self._lead(runs[0][0])
        for k, (a, b) in enumerate(runs):
            segments += self._stretch(a, b)
            if k + 1 < len(runs):
                segments += self._between(b, runs[k + 1][0])
        segments += self._tail(runs[-1][1], last)
        return replace(self.whole, segments=tuple(segments))

    def _stretch(self, a: int, b: int) -> list[Segment]:
        """Return what the whole does from waypoint a to waypoint b."""
        starts = self.whole.starts
        found: list[Segment] = []
        for segment, start, end in zip(self.whole.segments, starts[:-1].tolist(), starts[1:].tolist(), strict=True):
            low, high = max(a, start) - start, min(b, end) - start
            if high > low:
                tips, axes = segment.tips[low : high + 1], segment.axes[low : high + 1]
                dwell = segment.dwell if high == end - start else None
                found.append(replace(segment, tips=tips, axes=axes, dwell=dwell))
        return found

    def _lead(self, a: int) -> list[Segment]:
        if not self.cutting[:a].any():
            return self._stretch(0, a)
        down = self._approach(a)
        return [links.entry(down.tips[0], down.axes[0], self.style), down]

    def _tail(self, b: int, last: int) -> list[Segment]:
        if not self.cutting[b:].any():
            return self._stretch(b, last)
        up = self._retract(b)
        return [up, links.leave(up.tips[-1], up.axes[-1], self.style)]

    def _between(self, b: int, a: int) -> list[Segment]:
        if not self.cutting[b:a].any():
            return self._stretch(b, a)
        up, down = self._retract(b), self._approach(a)
        return [up, links.rapid(up.tips[-1], up.axes[-1], down.tips[0], down.axes[0], self.style), down]

    def _approach(self, a: int) -> Segment:
        tips = self.whole.tips
        return links.approach(tips[a], self.whole.axes[a], tips[a + 1] - tips[a], self.style)

    def _retract(self, b: int) -> Segment:
        tips = self.whole.tips
        return links.retract(tips[b], self.whole.axes[b], tips[b] - tips[b - 1], self.style)
