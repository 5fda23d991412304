"""The remaining path from a station on, with its feeds overridden."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.timing.path.path import PieceLike
from pentapod.toolpath.toolpath import SegmentKind


@dataclass(frozen=True, eq=False)
class RemainingPiece:
    """A piece from station `start` (m) to its end, as a piece of its own: fields as of `PieceLike`, s from `start`."""

    piece: PieceLike
    start: float
    length: float
    knots: Floats
    section_ends: Floats
    section_feeds: Floats
    section_kinds: Sequence[SegmentKind]
    section_segments: Ints
    waypoint_stations: Floats
    waypoints: Ints

    @classmethod
    def of(cls, piece: PieceLike, start: float, share: float, rapid: float) -> RemainingPiece:
        """Return the remaining piece with feeds times `share`.

        rapid: m/s, the tip's largest speed on rapids, on which a share below 1 acts too. The last waypoint before
        `start` is moved there.
        """
        length = piece.length - start
        knots = np.asarray(piece.knots, dtype=np.float64) - start
        ends = np.asarray(piece.section_ends, dtype=np.float64)
        section = min(int(np.searchsorted(ends, start, side="right")), len(ends) - 1)
        ends = ends[section:] - start
        ends[-1] = length
        feeds = np.asarray(piece.section_feeds, dtype=np.float64)[section:]
        waypoint = max(int(np.searchsorted(piece.waypoint_stations, start, side="right")) - 1, 0)
        return cls(
            piece,
            start,
            length,
            knots=np.concatenate([[0.0], knots[(knots > 0.0) & (knots < length)], [length]]),
            section_ends=ends,
            section_feeds=np.where(np.isfinite(feeds), feeds * share, rapid * share if share < 1.0 else np.inf),
            section_kinds=piece.section_kinds[section:],
            section_segments=np.asarray(piece.section_segments)[section:],
            waypoint_stations=np.maximum(np.asarray(piece.waypoint_stations)[waypoint:] - start, 0.0),
            waypoints=np.asarray(piece.waypoints)[waypoint:],
        )

    def feed_rate(self, s: Floats) -> Floats:
        """Return how far (n,) the feed's point moves for each metre of s."""
        return self.piece.feed_rate(self._along(s))

    def pose(self, s: Floats, order: int = 0) -> tuple[Floats, Floats]:
        """Return tips and tool axes (n, 3) or their derivatives."""
        return self.piece.pose(self._along(s), order)

    def __call__(self, s: Floats, order: int = 0) -> Floats:
        """Return legs (n, legs) or their derivatives."""
        return self.piece(self._along(s), order)

    def derivatives(self, s: Floats, order: int) -> list[Floats]:
        """Return legs and their derivatives (n, legs) up to `order`."""
        return self.piece.derivatives(self._along(s), order)

    def _along(self, s: Floats) -> Floats:
        return np.minimum(np.asarray(s, dtype=np.float64) + self.start, self.piece.length)


@dataclass(frozen=True, eq=False)
class RemainingPath:
    """Remaining pieces in order, as a path of its own. dwells (P + 1,): as of `LegPathLike`, seconds."""

    pieces: tuple[RemainingPiece, ...]
    dwells: Floats

    @property
    def starts(self) -> Floats:
        """Station (P + 1,) at which each piece starts, and the end."""
        return np.concatenate([[0.0], np.cumsum([piece.length for piece in self.pieces])])
