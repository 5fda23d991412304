"""Relinking: links and rapids that meet the part, replaced by ways over the clearance level.

A cut that was leaned, lifted or dropped leaves links behind that were laid for the cut as it was.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from pentapod.base.arrays import Bools
from pentapod.toolpath.linking import links
from pentapod.toolpath.linking.links import LinkStyle
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath


def relinked(
    path: Toolpath, meeting: Bools, style: LinkStyle, clear: Callable[[Segment], bool]
) -> tuple[Toolpath, int]:
    """Return a path with other ways between its cuts wherever one of the motions (N − 1,) in `meeting` is.

    The way goes up along the axis, over the style's level, and down along the axis, with `clear` asked for each of its
    segments; where it is not clear, the old one stays. Also returned: how many ways were changed.
    """
    cuts = [k for k, segment in enumerate(path.segments) if segment.kind is SegmentKind.CUT]
    if not cuts:
        return path, 0
    segments: list[Segment] = []
    changed = 0
    for before, after in zip([None, *cuts], [*cuts, None], strict=True):
        first, last = 0 if before is None else before + 1, len(path.segments) if after is None else after
        way = list(path.segments[first:last])
        if meeting[int(path.starts[first]) : int(path.starts[last])].any():
            other = _way(
                None if before is None else path.segments[before],
                None if after is None else path.segments[after],
                style,
            )
            if all(clear(segment) for segment in other):
                way, changed = other, changed + 1
        segments += way if after is None else [*way, path.segments[after]]
    return replace(path, segments=tuple(segments)), changed


def _way(before: Segment | None, after: Segment | None, style: LinkStyle) -> list[Segment]:
    """Return the way from the end of a cut, or from the clearance level, to the start of another, or to that level."""
    up = down = None
    if before is not None:
        up = links.retract(before.tips[-1], before.axes[-1], before.tips[-1] - before.tips[-2], style)
    if after is not None:
        down = links.approach(after.tips[0], after.axes[0], after.tips[1] - after.tips[0], style)
    if up is None and down is not None:
        return [links.entry(down.tips[0], down.axes[0], style), down]
    if down is None and up is not None:
        return [up, links.leave(up.tips[-1], up.axes[-1], style)]
    if up is None or down is None:
        return []
    return [up, links.rapid(up.tips[-1], up.axes[-1], down.tips[0], down.axes[0], style), down]
