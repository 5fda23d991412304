"""Ways over the part in place of moves to the home position."""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.toolpath.formats.gcode.language.options import OPTIONS
from pentapod.toolpath.formats.moves import Moves
from pentapod.toolpath.toolpath import SegmentKind

_ALONG = 0.5
"""Cosine of the largest angle from the common direction at which the tool rises along its own axis."""


def lift(moves: Moves, places: list[int], *, at_end: bool) -> float:
    """Lead each move to a pose in `places` over the part; at_end: rise after the last pose. Return the level, mm.

    The level lies along the mean of all axes, above all cuts by the clearance, and above all poses.
    """
    tips, axes = np.array(moves.tips), np.array(moves.axes)
    up = axes.mean(axis=0)
    size = float(np.linalg.norm(up))
    up = up / size if size > OPTIONS.axis_tolerance else np.array([0.0, 0.0, 1.0])
    heights = tips @ up
    on_feed = np.array([kind is not SegmentKind.RAPID for kind in moves.kinds])
    cuts = float(heights[on_feed].max()) if on_feed.any() else float(heights.max())
    level = max(float(heights.max()), cuts + OPTIONS.clearance)
    _insert(moves, [k for k in places if 0 < k < len(tips)], tips, axes, up, level)
    if at_end and len(tips):
        _add(moves, _risen(tips[-1], axes[-1], up, level), axes[-1])
    return level


def _risen(tip: Floats, axis: Floats, up: Floats, level: float) -> Floats:
    """Return the place at the level above a tip, along its axis where that leads up."""
    along = float(axis @ up)
    way = axis / along if along > _ALONG else up
    return tip + max(level - float(tip @ up), 0.0) * way


def _insert(moves: Moves, places: list[int], tips: Floats, axes: Floats, up: Floats, level: float) -> None:
    """Insert two rapids before each pose of `places`, at the level; from the last one, so that places stay valid."""
    parts: list[tuple[int, list[tuple[Floats, Floats]]]] = [
        (k, [(_risen(tips[j], axes[j], up, level), axes[j]) for j in (k - 1, k)]) for k in sorted(set(places))
    ]
    if not parts:
        return
    whole = Moves(moves.file, wait=moves.wait)
    begin = 0
    for k, raised in [*parts, (len(tips), [])]:
        whole.extend(moves, begin, k)
        for tip, axis in raised:
            _add(whole, tip, axis)
        begin = k
    whole.words.update({len(whole.tips): moves.words[len(tips)]} if len(tips) in moves.words else {})
    moves.replace(whole)


def _add(moves: Moves, tip: Floats, axis: Floats) -> None:
    x, y, z = tip.tolist()
    a, b, c = axis.tolist()
    moves.add((x, y, z), (a, b, c), SegmentKind.RAPID, math.inf, 0, "")
