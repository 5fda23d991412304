"""Clear links: motions between cuts that collide are replaced by ways out of the part and rapids above it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.geometry.directions import fastest_turn
from pentapod.geometry.polyline import arc_length, spaced
from pentapod.toolpath.linking.links import blended, connection, turning
from pentapod.toolpath.linking.ways_out import WayOut, WaysOut
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath


@dataclass(frozen=True, eq=False)
class ClearedPath:
    """replaced: number of links replaced. dropped: number of motions of cuts that the tool cannot leave."""

    path: Toolpath
    replaced: int = 0
    dropped: int = 0


def cleared(path: Toolpath, colliding: Bools, ways: WaysOut, *, may_drop: bool) -> ClearedPath:
    """Return a path with other motions between cuts wherever one of them collides with the part.

    colliding (N − 1,): which motions collide. First the usual link over the clearance level is tried, then the ways
    out. A cut without any way out is left out where `may_drop`; else its links stay as they are.
    """
    cuts = [k for k, segment in enumerate(path.segments) if segment.kind is SegmentKind.CUT]
    search = _Search(path, colliding, ways)
    kept: list[int | None] = [*cuts]
    while may_drop:
        stuck = {cut for ends in _gaps(kept) for cut in search.stuck(*ends)}
        if not stuck:
            break
        kept = [cut for cut in kept if cut not in stuck]
    if not kept:
        return ClearedPath(path)
    segments: list[Segment] = []
    for before, after in _gaps(kept):
        segments += search.link(before, after)
        segments += [] if after is None else [path.segments[after]]
    dropped = sum(len(path.segments[k].tips) - 1 for k in cuts if k not in kept)
    return ClearedPath(replace(path, segments=tuple(segments)), search.replaced, dropped)


def _gaps(kept: list[int | None]) -> list[tuple[int | None, int | None]]:
    """Return the cuts before and after each gap between cuts; None at the ends of the path."""
    return list(zip([None, *kept], [*kept, None], strict=True)) if kept else []


class _Search:
    """The links of one path, each searched for once."""

    def __init__(self, path: Toolpath, colliding: Bools, ways: WaysOut) -> None:
        self.path, self.colliding, self.ways = path, colliding, ways
        self.replaced = 0
        self._found: dict[tuple[int | None, int | None], list[Segment] | None] = {}
        self._ways: dict[tuple[int, bool], WayOut | None] = {}

    def stuck(self, before: int | None, after: int | None) -> list[int]:
        """Return which of the cuts on either side of a gap have no way out that the gap needs."""
        if not self._collides(before, after) or self._link(before, after) is not None:
            return []
        ends = [(cut, side) for cut, side in ((before, True), (after, False)) if cut is not None]
        return [cut for cut, side in ends if self._way(cut, side) is None]

    def link(self, before: int | None, after: int | None) -> list[Segment]:
        """Return the segments between two cuts: those of the path, or new ones where these collide."""
        first, last = self._between(before, after)
        if self._collides(before, after) and (new := self._link(before, after)) is not None:
            self.replaced += 1
            return new
        return list(self.path.segments[first:last])

    def _between(self, before: int | None, after: int | None) -> tuple[int, int]:
        return 0 if before is None else before + 1, len(self.path.segments) if after is None else after

    def _collides(self, before: int | None, after: int | None) -> bool:
        """Return whether the motions between two cuts collide, or hold a cut that is left out."""
        first, last = self._between(before, after)
        if any(segment.kind is SegmentKind.CUT for segment in self.path.segments[first:last]):
            return True
        return bool(self.colliding[int(self.path.starts[first]) : int(self.path.starts[last])].any())

    def _link(self, before: int | None, after: int | None) -> list[Segment] | None:
        """Return clear segments between two cuts; None where none are found."""
        key = before, after
        if key not in self._found:
            ends = [None if k is None else (self.path.segments[k].tips, self.path.segments[k].axes) for k in key]
            usual = connection(ends[0], ends[1], self.ways.style)
            is_clear = all(self.ways.clear(segment) for segment in usual)
            self._found[key] = usual if is_clear else self._around(before, after)
        return self._found[key]

    def _way(self, cut: int, at_end: bool) -> WayOut | None:
        if (cut, at_end) not in self._ways:
            tips, axes = self.path.segments[cut].tips, self.path.segments[cut].axes
            self._ways[cut, at_end] = self.ways.of((tips, axes) if at_end else (tips[::-1], axes[::-1]))
        return self._ways[cut, at_end]

    def _around(self, before: int | None, after: int | None) -> list[Segment] | None:
        """Return the way out of one cut, a rapid above the part, and the way into the next; None without."""
        out = None if before is None else self._way(before, True)
        into = None if after is None else self._way(after, False)
        if (out is None and before is not None) or (into is None and after is not None):
            return None
        rapid = self._rapid(out, into)
        if not self.ways.clear(rapid):
            return None
        back = [] if into is None else [_reversed(segment) for segment in reversed(into.links)]
        return [*(() if out is None else out.links), rapid, *back]

    def _rapid(self, out: WayOut | None, into: WayOut | None) -> Segment:
        """Return the rapid from one way out to the other; the axis turns above the part alone."""
        style = self.ways.style
        both = [way for way in (out, into) if way is not None]
        first, last = both[0].axis, both[-1].axis
        if len(both) == 1:
            tips = spaced(both[0].corners if into is None else both[0].corners[::-1], style.rapid_spacing)
            return Segment(SegmentKind.RAPID, tips, np.tile(first, (len(tips), 1)), np.inf)
        turn, level = fastest_turn(first, last), self.ways.level(first, last)
        up, down = (_raised(way.corners, level, style.view) for way in both)
        over = [up[1], down[1]]
        if (short := self.ways.search.lever * turn - float(np.linalg.norm(over[1] - over[0]))) > 0.0:
            over = [over[0], 0.5 * (over[0] + over[1]) + 0.5 * short * style.view, over[1]]
        corners = np.stack([up[0], *over, down[0]])
        length = float(np.linalg.norm(np.diff(np.stack(over), axis=0), axis=1).sum())
        path = blended(corners, style)
        # Midway the axis turns 15/8 times as fast as on average. Without a turn the length may be next to none.
        turns = 1.875 * turn / style.axis_step
        tips = spaced(path, min(style.rapid_spacing, length / turns) if turns > 1.0 else style.rapid_spacing)
        along = arc_length(tips)
        rises = [float(np.linalg.norm(way[1] - way[0])) for way in (up, down)]
        share = (along - rises[0]) / max(along[-1] - sum(rises), 1e-12)
        return Segment(SegmentKind.RAPID, tips, turning(first, last, np.clip(share, 0.0, 1.0), style.view), np.inf)


def _raised(corners: Floats, level: float, view: Floats) -> Floats:
    """Return the corners (2, 3) of a rise with its upper end at least at a level."""
    return np.stack([corners[0], corners[1] + max(level - float(corners[1] @ view), 0.0) * view])


def _reversed(segment: Segment) -> Segment:
    return replace(segment, tips=segment.tips[::-1], axes=segment.axes[::-1])
