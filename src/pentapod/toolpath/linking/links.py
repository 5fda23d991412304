"""Approaches, retracts, ramps and rapids: how the tool comes to a pass, leaves it, and travels between passes.

A *rapid* leaves along the tool axis, rises along the view to the clearance level, crosses, and comes down the
same way; its corners are blended, and the axis turns along the great circle, gently at both ends. The last
stretch to the surface and the first away from it, `approach` high, is a link on feed. A *hop* is a rapid that crosses
close above the part instead of at the clearance level. A link to a pass close by stays on the
surface (see `stay_down`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.geometry.directions import angle_between
from pentapod.geometry.polyline import arc_length, spaced
from pentapod.toolpath.options import Entry
from pentapod.toolpath.toolpath import Segment, SegmentKind

RAPID_SPACING_M = 5e-3
RAPID_AXIS_STEP = np.radians(3.0)
_SAME_CORNER_M = 1e-4


@dataclass(frozen=True)
class LinkStyle(Value):
    """How links are made. view (3,): unit, towards the tool. level: metres along it at which rapids cross.

    approach, spacing: metres. feed: of links on feed, m/s. entry: their form. axis_step: radians between waypoints of
    rapids, rapid_spacing: metres between them. blend: metres of each leg, at most, that the arc at a corner takes.
    arc_step: radians between points of arcs.
    """

    view: Floats
    level: float
    approach: float
    spacing: float
    feed: float
    entry: Entry = Entry.AXIS
    axis_step: float = RAPID_AXIS_STEP
    rapid_spacing: float = RAPID_SPACING_M
    blend: float = 5e-3
    arc_step: float = float(np.radians(6.0))


def approach(tip: Floats, axis: Floats, ahead: Floats, style: LinkStyle) -> Segment:
    """Return the link on feed to a pass that begins at `tip` (3,) with `axis` (3,) and goes `ahead` (3,).

    Along the axis; or straight down a ramp against the way ahead, half as steep as long; or down a quarter of a
    circle that ends along the way ahead. All begin `approach` metres above the tip along the axis.
    """
    flat = ahead - (ahead @ axis) * axis
    length = float(np.linalg.norm(flat))
    if style.entry is Entry.AXIS or length < 1e-12:
        corners = np.stack([tip + style.approach * axis, tip])
    elif style.entry is Entry.STRAIGHT:
        corners = np.stack([tip + style.approach * (axis - 2.0 * flat / length), tip])
    else:
        turn = np.linspace(0.5 * np.pi, 0.0, 2 + int(np.ceil(0.5 * np.pi / style.arc_step)))[:, None]
        corners = tip + style.approach * ((1.0 - np.cos(turn)) * axis - np.sin(turn) * flat / length)
        corners[-1] = tip
    tips = spaced(corners, style.spacing)
    return Segment(SegmentKind.LINK, tips, np.tile(axis, (len(tips), 1)), style.feed)


def retract(tip: Floats, axis: Floats, ahead: Floats, style: LinkStyle) -> Segment:
    """Return the link on feed away from a pass that ends at `tip` (3,), going `ahead` (3,): an approach reversed."""
    back = approach(tip, axis, -ahead, style)
    return Segment(SegmentKind.LINK, back.tips[::-1], back.axes[::-1], style.feed)


def rapid(start: Floats, start_axis: Floats, end: Floats, end_axis: Floats, style: LinkStyle) -> Segment:
    """Return the rapid between two poses, off the surface by `approach`, over the clearance level."""
    up = _rise(start, start_axis, style)
    down = _rise(end, end_axis, style)[::-1]
    way = blended(np.vstack([up, down]), style)
    # Midway the axis turns 15/8 times as fast as on average.
    turn = 1.875 * float(angle_between(start_axis, end_axis))
    length = float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())
    tips = spaced(way, min(style.rapid_spacing, length * style.axis_step / max(turn, style.axis_step)))
    return Segment(SegmentKind.RAPID, tips, _turning(start_axis, end_axis, tips), np.inf)


def entry(tip: Floats, axis: Floats, style: LinkStyle) -> Segment:
    """Return the rapid from the clearance level down to the start of an approach at `tip` (3,)."""
    tips = spaced(blended(_rise(tip, axis, style)[::-1], style), style.rapid_spacing)
    return Segment(SegmentKind.RAPID, tips, np.tile(axis, (len(tips), 1)), np.inf)


def leave(tip: Floats, axis: Floats, style: LinkStyle) -> Segment:
    """Return the rapid from the end of a retract at `tip` (3,) up to the clearance level."""
    tips = spaced(blended(_rise(tip, axis, style), style), style.rapid_spacing)
    return Segment(SegmentKind.RAPID, tips, np.tile(axis, (len(tips), 1)), np.inf)


def _rise(tip: Floats, axis: Floats, style: LinkStyle) -> Floats:
    """Return the corners (3, 3) of the way up: on along the axis, then along the view to the level."""
    knee = tip + style.approach * axis
    return np.stack([tip, knee, knee + max(style.level - float(knee @ style.view), 0.0) * style.view])


def _turning(start: Floats, end: Floats, tips: Floats) -> Floats:
    """Return axes (N, 3) along the great circle from one axis to the other, at rest at both ends."""
    length = arc_length(tips)
    t = length / length[-1]
    t = t**3 * (10.0 - 15.0 * t + 6.0 * t * t)
    angle = float(angle_between(start, end))
    if angle < 1e-9:
        axes = (1.0 - t)[:, None] * start + t[:, None] * end
    else:
        axes = np.sin((1.0 - t) * angle)[:, None] * start + np.sin(t * angle)[:, None] * end
    axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    axes[0], axes[-1] = start, end
    return axes


def blended(corners: Floats, style: LinkStyle) -> Floats:
    """Return a polyline (M, 3) with its inner corners replaced by parabolic arcs; ends and legs stay.

    An arc takes up to `blend` of each leg, less than half of it, so that arcs never meet.
    """
    apart = np.linalg.norm(np.diff(corners, axis=0), axis=1) > _SAME_CORNER_M
    keep = np.concatenate([[True], apart])
    if not apart[-1] and keep[1:-1].any():
        keep[np.flatnonzero(keep)[-1]] = False
    keep[-1] = True
    corners = corners[keep]
    parts = [corners[:1]]
    for before, corner, after in zip(corners, corners[1:], corners[2:], strict=False):
        turn = float(angle_between(corner - before, after - corner)) if len(corners) > 2 else 0.0
        if turn < 1e-6:
            continue
        if turn > np.pi - 1e-3:  # straight back: an arc would run through the same points twice
            parts.append(corner[None])
            continue
        back, ahead = before - corner, after - corner
        reach = min(style.blend, 0.45 * float(np.linalg.norm(back)), 0.45 * float(np.linalg.norm(ahead)))
        enter = corner + reach * back / np.linalg.norm(back)
        leave_at = corner + reach * ahead / np.linalg.norm(ahead)
        t = np.linspace(0.0, 1.0, 2 + int(np.ceil(turn / style.arc_step)))[:, None]
        parts.append((1.0 - t) ** 2 * enter + 2.0 * t * (1.0 - t) * corner + t * t * leave_at)
    parts.append(corners[-1:])
    return np.vstack(parts)
