"""Report of pieces whose law had to be slower than their first one, so that the setpoints keep the limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.values import Value
from pentapod.timing.path.path import LegPathLike
from pentapod.timing.time_law.motion_law import MotionLaw
from pentapod.timing.time_law.refusals import segment_at, waypoints_at

REPORTED_FROM = 1.02
"""A piece is reported that lasts more than this many times as long as its first law, and a period."""


@dataclass(frozen=True)
class Slowed(Value):
    """A piece that lasts longer than its first jerk-limited law, so that its setpoints keep the limits.

    piece: its index in the path; first, duration: seconds of its first law and of its final one; station: global s in
    metres about which most of the time is lost; segment of the toolpath there; waypoints on both sides.
    """

    piece: int
    first: float
    duration: float
    station: float
    segment: int
    waypoints: tuple[int, int]

    def __str__(self) -> str:
        longer = self.duration / self.first - 1.0
        low, high = self.waypoints
        beside = f"at waypoint {low}" if low == high else f"between waypoints {low} and {high}"
        by = f"{100.0 * longer:.1f} % longer than" if longer < 1.0 else f"{longer + 1.0:.3g} times as long as"
        return (
            f"piece {self.piece} lasts {self.duration:.3f} s, {by} its first law ({self.first:.3f} s), so that its "
            f"setpoints keep the limits; most is lost {1e3 * self.station:.1f} mm along the path, in segment "
            f"{self.segment}, {beside}"
        )


def slowed(path: LegPathLike, k: int, first: MotionLaw, law: MotionLaw, period: float) -> Slowed | None:
    """Return the report on piece k of a path; None where its law is about as fast as its first one."""
    if law.duration <= REPORTED_FROM * first.duration + period:
        return None
    piece, s = path.pieces[k], most_lost(first, law)
    station = float(path.starts[k]) + s
    return Slowed(k, first.duration, law.duration, station, segment_at(piece, s), waypoints_at(piece, s))


def most_lost(first: MotionLaw, law: MotionLaw, parts: int = 512) -> float:
    """Return the middle of that one of equal parts of a piece in which a law loses most time against its first one."""
    s = np.linspace(0.0, law.length, parts + 1)
    lost = np.diff(np.interp(s, law.stations, law.times) - np.interp(s, first.stations, first.times))
    worst = int(lost.argmax())
    return float((s[worst] + s[worst + 1]) / 2.0)
