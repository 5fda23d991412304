"""Arcs and helices: centre, sweep and points, in the coordinates of the program."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from pentapod.toolpath.formats.gcode.language.options import OPTIONS
from pentapod.toolpath.formats.rotary import Vector

PLANES = {17.0: ("X", "Y", "Z"), 18.0: ("Z", "X", "Y"), 19.0: ("Y", "Z", "X")}
"""The axes of each plane, so that a positive turn leads from the first to the second, and its normal."""

CENTRE = {"X": "I", "Y": "J", "Z": "K"}
"""Words of an arc's centre."""

_SAME = 1e-7
"""Millimetres up to which two points are the same: a full turn."""


class ArcError(ValueError):
    """An arc that cannot be: what is wrong with it."""


@dataclass(frozen=True)
class Arc:
    """An arc in the plane of `axes[:2]`, a helix along `axes[2]`. Millimetres and radians.

    centre: of the plane. begin: angle of the start. sweep: positive from the first axis to the second.
    """

    axes: tuple[str, str, str]
    centre: tuple[float, float]
    begin: float
    sweep: float
    radii: tuple[float, float]
    heights: tuple[float, float]
    end: Mapping[str, float]

    def point(self, share: float) -> dict[str, float]:
        """Return the point at a share of the sweep, by letter."""
        if share >= 1.0:
            return dict(self.end)
        angle = self.begin + share * self.sweep
        radius = self.radii[0] + share * (self.radii[1] - self.radii[0])
        height = self.heights[0] + share * (self.heights[1] - self.heights[0])
        x, y = self.centre[0] + radius * math.cos(angle), self.centre[1] + radius * math.sin(angle)
        return dict(zip(self.axes, (x, y, height), strict=True))

    def chords(self, tolerance: float) -> int:
        """Return the number of chords that leave the arc by at most `tolerance`."""
        radius = max(self.radii)
        if radius <= tolerance:
            return max(2, math.ceil(abs(self.sweep) / (0.5 * math.pi)))
        step = max(2.0 * math.acos(1.0 - tolerance / radius), 1e-12)
        return max(1, math.ceil(min(abs(self.sweep) / step - 1e-9, 1e12)))


def arc_between(
    start: Mapping[str, float],
    end: Mapping[str, float],
    plane: float,
    *,
    clockwise: bool,
    centre: Mapping[str, float] | None = None,
    radius: float | None = None,
    turns: int = 0,
) -> Arc:
    """Return the arc from start to end (mm, by letter), by its centre (coordinates by letter) or its radius.

    radius: negative for more than half a turn. turns: full turns in addition. Raises ArcError where there is none.
    """
    axes = PLANES[plane]
    a, b, c = axes
    s, e = (start[a], start[b]), (end[a], end[b])
    if radius is not None:
        middle = _centre_of(s, e, radius, clockwise=clockwise)
    elif centre is not None:
        middle = (centre[a], centre[b])
    else:
        raise ArcError("an arc needs its centre or its radius")
    r0, r1 = math.dist(s, middle), math.dist(e, middle)
    if not r0 > 0.0:
        raise ArcError("the arc's centre is its start")
    if abs(r0 - r1) > max(OPTIONS.arc_mismatch, OPTIONS.arc_mismatch_share * r0):
        raise ArcError(f"start and end are at different distances from the arc's centre: {r0:.4f} and {r1:.4f} mm")
    begin = math.atan2(s[1] - middle[1], s[0] - middle[0])
    sense = -1.0 if clockwise else 1.0
    turn = sense * (math.atan2(e[1] - middle[1], e[0] - middle[0]) - begin) % (2.0 * math.pi)
    if turn == 0.0 or math.dist(s, e) <= _SAME:
        turn = 2.0 * math.pi
    sweep = sense * (turn + 2.0 * math.pi * turns)
    return Arc(axes, middle, begin, sweep, (r0, r1), (start[c], end[c]), {k: end[k] for k in axes})


def _centre_of(
    s: tuple[float, float], e: tuple[float, float], radius: float, *, clockwise: bool
) -> tuple[float, float]:
    half = 0.5 * math.dist(s, e)
    if half <= 0.5 * _SAME:
        raise ArcError("an arc with a radius that ends where it begins: give its centre")
    if half > abs(radius) + OPTIONS.arc_mismatch:
        raise ArcError(f"the radius {abs(radius):.4f} mm is less than half the distance to the end, {half:.4f} mm")
    height = math.sqrt(max(radius * radius - half * half, 0.0)) / (2.0 * half)
    side = -height if clockwise == (radius > 0.0) else height
    x, y = 0.5 * (s[0] + e[0]), 0.5 * (s[1] + e[1])
    return x - side * (e[1] - s[1]), y + side * (e[0] - s[0])


def interpolated(start: Mapping[str, float], end: Mapping[str, float], share: float) -> dict[str, float]:
    """Return the values at a share of the way between two places, by letter."""
    return {k: v if share >= 1.0 else start[k] + share * (v - start[k]) for k, v in end.items()}


def xyz(place: Mapping[str, float]) -> Vector:
    """Return the coordinates of a place."""
    return place["X"], place["Y"], place["Z"]
