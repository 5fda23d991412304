"""PiecePart: the rest of a piece from some station on, with its feeds overridden."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.timing.path.path import PieceLike
from pentapod.toolpath.toolpath import SegmentKind


@dataclass(frozen=True, eq=False)
class PiecePart:
    """The stretch of `piece` from station `start` (m) to its end, as a piece of its own.

    feed_share: factor on the feeds; rapid: m/s, the tip's largest speed on rapids, on which the factor acts as far as
    it slows them.
    """

    piece: PieceLike
    start: float
    feed_share: float
    rapid: float

    @property
    def length(self) -> float:
        """Length in s, metres."""
        return self.piece.length - self.start

    @property
    def knots(self) -> Floats:
        """Stations (K,) from the part's own start."""
        knots = np.asarray(self.piece.knots, dtype=np.float64) - self.start
        return np.concatenate([[0.0], knots[(knots > 0.0) & (knots < self.length)], [self.length]])

    @property
    def section_ends(self) -> Floats:
        """Stations (M,) from the part's own start."""
        ends = np.asarray(self.piece.section_ends, dtype=np.float64)[self._first :] - self.start
        ends[-1] = self.length
        return ends

    @property
    def section_feeds(self) -> Floats:
        """Overridden feeds (M,) in m/s; infinite where the rapid rate alone holds."""
        feeds = np.asarray(self.piece.section_feeds, dtype=np.float64)[self._first :]
        rapids = self.rapid * self.feed_share if self.feed_share < 1.0 else np.inf
        return np.where(np.isfinite(feeds), feeds * self.feed_share, rapids)

    @property
    def section_kinds(self) -> Sequence[SegmentKind]:
        """Kinds (M,) of the segments."""
        return self.piece.section_kinds[self._first :]

    @property
    def section_segments(self) -> Ints:
        """Indices (M,) of the toolpath's segments."""
        return np.asarray(self.piece.section_segments)[self._first :]

    @property
    def waypoint_stations(self) -> Floats:
        """Stations (W,) of the waypoints from the last one before the part on; that one is at its start."""
        return np.maximum(np.asarray(self.piece.waypoint_stations)[self._waypoint :] - self.start, 0.0)

    @property
    def waypoints(self) -> Ints:
        """Indices (W,) of these waypoints."""
        return np.asarray(self.piece.waypoints)[self._waypoint :]

    @property
    def _waypoint(self) -> int:
        return max(int(np.searchsorted(self.piece.waypoint_stations, self.start, side="right")) - 1, 0)

    @property
    def _first(self) -> int:
        ends = np.asarray(self.piece.section_ends)
        return min(int(np.searchsorted(ends, self.start, side="right")), len(ends) - 1)

    def feed_rate(self, s: Floats) -> Floats:
        """Return how far (n,) the feed's point moves for each metre of s, at stations (n,) from the part's start."""
        return self.piece.feed_rate(self._along(s))

    def pose(self, s: Floats, order: int = 0) -> tuple[Floats, Floats]:
        """Return tips and tool axes (n, 3) or their derivatives at stations s (n,) from the part's own start."""
        return self.piece.pose(self._along(s), order)

    def __call__(self, s: Floats, order: int = 0) -> Floats:
        """Return legs (n, legs) or their derivatives at stations s (n,) from the part's own start."""
        return self.piece(self._along(s), order)

    def derivatives(self, s: Floats, order: int) -> list[Floats]:
        """Return legs and their derivatives (n, legs) up to `order` at stations s (n,) from the part's own start."""
        return self.piece.derivatives(self._along(s), order)

    def _along(self, s: Floats) -> Floats:
        return np.minimum(np.asarray(s, dtype=np.float64) + self.start, self.piece.length)


@dataclass(frozen=True, eq=False)
class PathParts:
    """Parts of pieces, one after the other, as a path of its own. dwells (P + 1,): as of any path, seconds."""

    pieces: tuple[PiecePart, ...]
    dwells: Floats

    @property
    def starts(self) -> Floats:
        """Station (P + 1,) at which each part starts, and the end."""
        return np.concatenate([[0.0], np.cumsum([piece.length for piece in self.pieces])])
