"""Limit of the feed rate: on cuts and links, the speed of the tip or of a beam's spot on the surface."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

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
        """Return the largest ṡ (n,), m/s, that the feeds allow at stations s (n,); infinite on rapids."""
        marks, levels = self._levels_of(piece)
        speed = levels[np.searchsorted(marks, s, "left") + np.searchsorted(marks, s, "right") - 1]
        with np.errstate(divide="ignore"):
            return speed / piece.feed_rate(s)

    def _levels_of(self, piece: PieceLike) -> tuple[Floats, Floats]:
        """Return the stations (K,) where guarded sections begin or end, and the feeds (2 K,): at each, and after it."""
        key = id(piece)
        if key not in self._levels:
            begins, ends, _ = self.guarded_sections(piece)
            marks = np.unique(np.concatenate([begins, ends]))
            levels = np.full(2 * len(marks), np.inf)
            first, last = 2 * np.searchsorted(marks, begins), 2 * np.searchsorted(marks, ends) + 1
            for m, feed in enumerate(self._feeds(piece).tolist()):  # guarded sections overlap their neighbours
                here = slice(int(first[m]), int(last[m]))
                levels[here] = np.minimum(levels[here], feed)
            self._levels[key] = piece, marks, levels
        return self._levels[key][1:]

    @cached_property
    def _levels(self) -> dict[int, tuple[PieceLike, Floats, Floats]]:
        """What `_levels_of` has found, by a piece's identity; the piece itself keeps that from being used again."""
        return {}

    def _feeds(self, piece: PieceLike) -> Floats:
        return np.asarray(piece.section_feeds, dtype=np.float64) * self.limit

    def speed_rows(self, path: PathDerivatives) -> Floats:
        """Return the largest ṡ (n, 1)."""
        return self.speeds(path.piece, path.s)[:, None]

    def measured(self, setpoints: InterpolatedSetpoints) -> Floats:
        """Return the shares (intervals, 1) of the feeds themselves, without the reserve."""
        speed = self.speeds(setpoints.piece, setpoints.rows.stations[setpoints.own_rows]) / self.limit
        return (setpoints.station.rates[setpoints.own_intervals, 0] / np.minimum(speed[:-1], speed[1:]))[:, None]
