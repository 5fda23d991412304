"""Link segments: approaches, retracts and rapids between passes.

A *rapid* leaves along the tool axis, rises along the view to the clearance level, crosses, and comes down the same way;
its corners are blended, and the axis turns along the great circle, slowly at both ends. The first stretch away from the
surface and the last one to it, `approach` high, are links on feed. A *hop* is a rapid that crosses just above the part
instead of at the clearance level. Links that stay on the surface are made in `stay_down_links`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.geometry.directions import NEARLY_OPPOSITE, angle_between, eased, fastest_turn, turned
from pentapod.geometry.polyline import arc_length, spaced
from pentapod.toolpath.options import Entry
from pentapod.toolpath.toolpath import Segment, SegmentKind

Poses = tuple[Floats, Floats]
"""Tips (n, 3), metres, and unit axes (n, 3)."""
Pose = tuple[Floats, Floats, Floats]
"""A tip (3,), metres, a unit axis (3,), and the unit direction (3,) in which the tip leaves the surface."""


@dataclass(frozen=True)
class LinkStyle(Value):
    """How links are made. view (3,): unit, towards the tool. level: height of rapids along the view, metres.

    approach, spacing: metres. feed: of links on feed, m/s. entry: their form. axis_step: largest turn between waypoints
    of rapids, radians. rapid_spacing: largest distance between them, metres. blend: largest length of each leg that the
    arc at a corner takes, metres. arc_step: turn between points of arcs, radians. same_corner: corners nearer than this
    are one, metres.

    >>> style = LinkStyle(view=np.array([0.0, 0.0, 1.0]), level=0.05, approach=3e-3, spacing=2e-3, feed=0.05)
    """

    view: Floats
    level: float
    approach: float
    spacing: float
    feed: float
    entry: Entry = Entry.AXIS
    axis_step: float = float(np.radians(3.0))
    rapid_spacing: float = 5e-3
    blend: float = 5e-3
    arc_step: float = float(np.radians(6.0))
    same_corner: float = 1e-4


def approach(tips: Floats, axes: Floats, style: LinkStyle, leave: Floats | None = None) -> Segment:
    """Return the link on feed to the beginning of a pass with tips and axes (n, 3), n ≥ 2.

    Along the axis; or straight down a ramp in the direction of the pass, twice as long as high; or down a quarter of a
    circle that ends in this direction. All begin `approach` metres above the tip along the axis. leave (3,): unit, in
    place of the axis where the entry is along it.
    """
    tip, axis, ahead = tips[0], axes[0], tips[1] - tips[0]
    flat = ahead - (ahead @ axis) * axis
    length = float(np.linalg.norm(flat))
    if style.entry is Entry.AXIS or length < 1e-12:
        corners = np.stack([tip + style.approach * (axis if leave is None else leave), tip])
    elif style.entry is Entry.STRAIGHT:
        corners = np.stack([tip + style.approach * (axis - 2.0 * flat / length), tip])
    else:
        turn = np.linspace(0.5 * np.pi, 0.0, 2 + int(np.ceil(0.5 * np.pi / style.arc_step)))[:, None]
        corners = tip + style.approach * ((1.0 - np.cos(turn)) * axis - np.sin(turn) * flat / length)
        corners[-1] = tip
    points = spaced(corners, style.spacing)
    return Segment(SegmentKind.LINK, points, np.tile(axis, (len(points), 1)), style.feed)


def retract(tips: Floats, axes: Floats, style: LinkStyle, leave: Floats | None = None) -> Segment:
    """Return the link on feed away from the end of a pass: an approach reversed."""
    back = approach(tips[::-1], axes[::-1], style, leave)
    return Segment(SegmentKind.LINK, back.tips[::-1], back.axes[::-1], style.feed)


def rapid(start: Pose | None, end: Pose | None, style: LinkStyle) -> Segment:
    """Return the rapid from the end of a retract to the start of an approach, at the clearance height.

    Without a start it comes from that level, without an end it stays there; one of them is given.
    """
    up = [] if start is None else [rise(start[0], start[2], style)]
    down = [] if end is None else [rise(end[0], end[2], style)[::-1]]
    path = blended(np.vstack([*up, *down]), style)
    axes = [pose[1] for pose in (start, end) if pose is not None]
    first, last = axes[0], axes[-1]
    if start is None or end is None:
        tips = spaced(path, style.rapid_spacing)
        return Segment(SegmentKind.RAPID, tips, np.tile(first, (len(tips), 1)), np.inf)
    # Midway the axis turns 15/8 times as fast as on average.
    turn = 1.875 * fastest_turn(first, last)
    length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    tips = spaced(path, min(style.rapid_spacing, length * style.axis_step / max(turn, style.axis_step)))
    along = arc_length(tips)
    return Segment(SegmentKind.RAPID, tips, turning(first, last, along / along[-1], style.view), np.inf)


def connection(before: Poses | None, after: Poses | None, style: LinkStyle) -> list[Segment]:
    """Return retract, rapid and approach from the end of one pass to the beginning of the next.

    Without a pass before, it begins at the clearance level; without a pass after, it ends there. One of them is given.
    """
    up = [] if before is None else [retract(*before, style)]
    down = [] if after is None else [approach(*after, style)]
    start = (up[0].tips[-1], up[0].axes[-1], up[0].axes[-1]) if up else None
    end = (down[0].tips[0], down[0].axes[0], down[0].axes[0]) if down else None
    return [*up, rapid(start, end, style), *down]


def rise(tip: Floats, leave: Floats, style: LinkStyle) -> Floats:
    """Return the corners (3, 3) of the way up: on in the direction of leaving, then along the view to the level."""
    knee = tip + style.approach * leave
    return np.stack([tip, knee, knee + max(style.level - float(knee @ style.view), 0.0) * style.view])


def turning(start: Floats, end: Floats, t: Floats, view: Floats) -> Floats:
    """Return axes (N, 3) along the great circle from one axis to the other at shares t (N,), at rest at both ends.

    Opposite axes are joined through the view (3,).
    """
    t = eased(t)
    angle = float(angle_between(start, end))
    if angle < 1e-9:
        axes = (1.0 - t)[:, None] * start + t[:, None] * end
    elif angle >= NEARLY_OPPOSITE:
        axes = turned(start, end, t, view)
    else:
        axes = np.sin((1.0 - t) * angle)[:, None] * start + np.sin(t * angle)[:, None] * end
    axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    axes[0], axes[-1] = start, end
    return axes


def blended(corners: Floats, style: LinkStyle) -> Floats:
    """Return a polyline (M, 3) with its inner corners replaced by parabolic arcs; ends and legs stay.

    An arc takes up to `blend` of each leg, less than half of it, so that arcs never meet.
    """
    distinct = np.linalg.norm(np.diff(corners, axis=0), axis=1) > style.same_corner
    keep = np.concatenate([[True], distinct])
    if not distinct[-1] and keep[1:-1].any():
        keep[np.flatnonzero(keep)[-1]] = False
    keep[-1] = True
    corners = corners[keep]
    parts = [corners[:1]]
    for before, corner, after in zip(corners, corners[1:], corners[2:], strict=False):
        turn = float(angle_between(corner - before, after - corner))
        if turn < 1e-6:
            continue
        if turn > np.pi - 1e-3:  # straight back: an arc would run through the same points twice
            parts.append(corner[None])
            continue
        back, ahead = before - corner, after - corner
        reach = min(style.blend, 0.45 * float(np.linalg.norm(back)), 0.45 * float(np.linalg.norm(ahead)))
        arc_start = corner + reach * back / np.linalg.norm(back)
        arc_end = corner + reach * ahead / np.linalg.norm(ahead)
        t = np.linspace(0.0, 1.0, 2 + int(np.ceil(turn / style.arc_step)))[:, None]
        parts.append((1.0 - t) ** 2 * arc_start + 2.0 * t * (1.0 - t) * corner + t * t * arc_end)
    parts.append(corners[-1:])
    return np.vstack(parts)
