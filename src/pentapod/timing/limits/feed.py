"""Limit of the feed rate: on cuts and links, the speed of the tip or of a beam's spot on the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.limits.limit import MachineLimit, Reserve
from pentapod.timing.path.path import PathDerivatives, PieceLike
from pentapod.timing.path.setpoints import InterpolatedSetpoints


@dataclass(frozen=True, eq=False)
class Feed(MachineLimit):
    """The feeds of the path's sections; no limit on rapids.

    limit, bound (1,): shares of these feeds. guard: seconds by which a section's feed extends into its neighbours;
    rapid: m/s, the tip's largest speed, which bounds that distance.
    """

    quantity = "feed"
    unit = "m/s"
    group = "speed"
    sectional = True

    guard: float
    rapid: float

    @classmethod
    def of(cls, machine: Machine, reserve: Reserve) -> Feed:
        """Return the limit; the feeds are the path's."""
        return cls(np.array([reserve.slower]), np.ones(1), reserve.guard, machine.rapid_velocity * reserve.slower)

    def guarded_sections(self, piece: PieceLike) -> tuple[Floats, Floats, Floats]:
        """Return where each section's feed applies, from and to (M,) in metres, and the ṡ (M,) it allows there."""
        feeds = self._feeds(piece)
        ends = np.asarray(piece.section_ends, dtype=np.float64)
        begins = np.concatenate([[0.0], ends[:-1]])
        with np.errstate(divide="ignore"):
            before, after = (np.minimum(feeds / piece.feed_rate(s), self.rapid) for s in (begins, ends))
        low, high = np.maximum(begins - self.guard * before, 0.0), np.minimum(ends + self.guard * after, piece.length)
        return low, high, np.minimum(before, after)

    def speeds(self, piece: PieceLike, s: Floats) -> Floats:
        """Return the largest ṡ (n,), m/s, that the feeds allow at sorted stations s (n,); infinite on rapids."""
        speed, feeds = np.full(len(s), np.inf), self._feeds(piece)
        begins, ends, _ = self.guarded_sections(piece)
        first, last = np.searchsorted(s, begins, "left"), np.searchsorted(s, ends, "right")
        for m, feed in enumerate(feeds.tolist()):  # guarded sections overlap their neighbours
            here = slice(int(first[m]), int(last[m]))
            speed[here] = np.minimum(speed[here], feed)
        with np.errstate(divide="ignore"):
            return speed / piece.feed_rate(s)

    def _feeds(self, piece: PieceLike) -> Floats:
        return np.asarray(piece.section_feeds, dtype=np.float64) * self.limit

    def speed_rows(self, path: PathDerivatives) -> Floats:
        """Return the largest ṡ (n, 1)."""
        return self.speeds(path.piece, path.s)[:, None]

    def measured(self, setpoints: InterpolatedSetpoints) -> Floats:
        """Return the shares (intervals, 1) of the feeds themselves, without the reserve."""
        speed = self.speeds(setpoints.piece, setpoints.rows.stations[setpoints.own_rows]) / self.limit
        return (setpoints.station.rates[setpoints.own_intervals, 0] / np.minimum(speed[:-1], speed[1:]))[:, None]
