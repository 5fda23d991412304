"""Moves: the poses of a toolpath file in order, as readers collect them and as writers need them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import ToolpathError
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

AXIS_TOLERANCE = 1e-4
"""Deviation from unit length that a tool axis in a file may have: enough for four decimals."""

SAME_FEED = 1e-6
"""Relative difference up to which two feeds are equal."""

REMARK, TILT_CENTRE_REMARK = "pentapod ", "tilt_centre_mm"
KIND_REMARKS = (SegmentKind.CUT, SegmentKind.LINK)
"""Comments by which files keep what their language has no word for: kinds of moves, and the tilt centre."""


@dataclass
class Moves:
    """Poses in the order of a file. Millimetres, mm/min; a rapid's feed is infinite.

    Each pose has the kind, feed and power of the move that leads to it; those of the first are not used. dwells:
    seconds of dwell at each pose, None where the tool does not stop; wait: seconds before the first pose. words: what
    the file says before the move to a pose, by its index, and after the last one: spindle, coolant, tool.
    """

    file: Path
    tips: list[tuple[float, float, float]] = field(default_factory=list)
    axes: list[tuple[float, float, float]] = field(default_factory=list)
    kinds: list[SegmentKind] = field(default_factory=list)
    feeds: list[float] = field(default_factory=list)
    powers: list[float] = field(default_factory=list)
    dwells: list[float | None] = field(default_factory=list)
    wait: float = 0.0
    words: dict[int, list[str]] = field(default_factory=dict[int, list[str]])

    def wrong(self, what: str, line: int, word: str | None = None, **details: Any) -> ToolpathError:
        """Return the error of a word in a line of the file."""
        return ToolpathError(what, file=self.file, line=line, key=word, **details)

    def add(
        self,
        tip: Sequence[float],
        axis: Sequence[float],
        kind: SegmentKind,
        feed: float,
        line: int,
        word: str,
        power: float = 1.0,
    ) -> None:
        """Add a pose. Raises ToolpathError where the axis is not of unit length."""
        length = math.hypot(*axis)
        if abs(length - 1.0) > AXIS_TOLERANCE:
            raise self.wrong("the tool axis has not unit length", line, word, value=round(length, 6), expected="1")
        self.tips.append((tip[0], tip[1], tip[2]))
        self.axes.append((axis[0] / length, axis[1] / length, axis[2] / length))
        self.kinds.append(kind)
        self.feeds.append(feed)
        self.powers.append(power)
        self.dwells.append(None)

    def add_dwell(self, seconds: float) -> None:
        """Add an exact stop and a dwell at the last pose."""
        if self.dwells:
            self.dwells[-1] = (self.dwells[-1] or 0.0) + seconds
        else:
            self.wait += seconds

    def add_words(self, words: str) -> None:
        """Keep what the file says before the next pose."""
        self.words.setdefault(len(self.tips), []).append(words)

    def extend(self, other: Moves, begin: int, end: int) -> None:
        """Add poses of other moves, with what is said before them."""
        shift = len(self.tips) - begin
        for name in ("tips", "axes", "kinds", "feeds", "powers", "dwells"):
            getattr(self, name).extend(getattr(other, name)[begin:end])
        self.words.update({k + shift: words for k, words in other.words.items() if begin <= k < end})

    def replace(self, other: Moves) -> None:
        """Take over all of other moves."""
        for name, value in vars(other).items():
            setattr(self, name, value)

    def toolpath(self, tilt_centre: float, notes: tuple[str, ...] = ()) -> Toolpath:
        """Return the toolpath: consecutive moves of equal kind, feed and power are a segment; repeated poses go.

        A dwell ends a segment, words begin one. tilt_centre: metres; notes: how the file was read. Raises ToolpathError
        for fewer than two poses.
        """
        tips, axes = np.array(self.tips).reshape(-1, 3) * 1e-3, np.array(self.axes).reshape(-1, 3)
        moved = np.ones(len(tips), dtype=np.bool_)
        moved[1:] = (np.diff(tips, axis=0) != 0.0).any(axis=1) | (np.diff(axes, axis=0) != 0.0).any(axis=1)
        rows = np.flatnonzero(moved)
        if len(rows) < 2:
            raise ToolpathError("the file holds no motion", file=self.file, expected="at least two different poses")
        feeds, powers = np.array(self.feeds)[rows], np.array(self.powers)[rows]
        kinds = [self.kinds[row] for row in rows]
        dwells = self._dwells(np.cumsum(moved) - 1, len(rows))
        words: dict[int, tuple[str, ...]] = {}
        for pose, said in sorted(self.words.items()):
            at = max(int(np.searchsorted(rows, pose)), 1)
            words[at] = (*words.get(at, ()), *said)
        breaks = [1]
        for k in range(2, len(rows)):
            same_feed = feeds[k] == feeds[k - 1] or abs(feeds[k] - feeds[k - 1]) <= SAME_FEED * feeds[k - 1]
            same = kinds[k] == kinds[k - 1] and same_feed and powers[k] == powers[k - 1]
            if not same or dwells[k - 1] is not None or k in words:
                breaks.append(k)
        segments = [
            Segment(
                kinds[a],
                tips[rows[a - 1 : b]],
                axes[rows[a - 1 : b]],
                feeds[a] / 6e4,
                float(powers[a]),
                dwells[b - 1],
                words.get(a, ()),
            )
            for a, b in pairwise([*breaks, len(rows)])
        ]
        wait = self.wait + (dwells[0] or 0.0)
        return Toolpath(tuple(segments), tilt_centre, wait, words.get(len(rows), ()), notes)

    def _dwells(self, owner: Ints, count: int) -> list[float | None]:
        """Return the dwells of the `count` poses that are kept. owner: the kept pose that each pose repeats, or is."""
        dwells: list[float | None] = [None] * count
        for pose, seconds in zip(owner.tolist(), self.dwells, strict=True):
            if seconds is not None:
                dwells[pose] = (dwells[pose] or 0.0) + seconds
        return dwells


def poses(toolpath: Toolpath) -> tuple[Floats, Floats, list[SegmentKind], Floats]:
    """Return tips (N, 3) in mm, axes (N, 3), and for each of the N − 1 moves its kind and its feed in mm/min."""
    owner = toolpath.segment_of_interval
    kinds = [toolpath.segments[k].kind for k in owner]
    feeds = np.array([segment.feed for segment in toolpath.segments])[owner] * 6e4
    return toolpath.tips * 1e3, toolpath.axes, kinds, feeds


def words_before(toolpath: Toolpath) -> dict[int, tuple[str, ...]]:
    """Return what is said of spindle, coolant and tool before waypoints, by their index.

    That of the first segment comes before the first waypoint.
    """
    starts = toolpath.starts[:-1].tolist()
    return {at + 1 if at else 0: one.words for at, one in zip(starts, toolpath.segments, strict=True) if one.words}


def dwell_times(toolpath: Toolpath) -> dict[int, float]:
    """Return the seconds of dwell at each waypoint where the tool stops, by the waypoint's index."""
    return {int(at): s for at, s in zip(toolpath.starts, toolpath.dwells, strict=True) if s is not None}


def plain(value: float, digits: int) -> str:
    """Return a number without exponent or negative zero, with at most this many decimals."""
    text = f"{value:.{digits}f}".rstrip("0")
    text = text + "0" if text.endswith(".") else text
    return "0.0" if text == "-0.0" else text


def kind_remark(kind: SegmentKind) -> str:
    """Return the comment before feed moves of a kind."""
    return f"{REMARK}{kind}"


def tilt_centre_remark(tilt_centre: float) -> str:
    """Return the comment with the tilt centre, given in metres."""
    return f"{REMARK}{TILT_CENTRE_REMARK} {1e3 * tilt_centre!r}"
