"""TrustRegion: how far each coefficient of a spline may move in the next program of the smoothing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from pentapod.base.arrays import Bools, Floats


@dataclass(frozen=True)
class TrustOptions:
    """Options of the trust region.

    largest, least: radii, as shares of the cone. shrink: factor where a step failed. ramp: coefficients over which a
    step that failed somewhere comes back to its full length beside these places.
    """

    largest: float = 2.0
    least: float = 1e-3
    shrink: float = 0.4
    ramp: int = 8


OPTIONS = TrustOptions()


@dataclass(eq=False)
class TrustRegion:
    """Radii (K,) of the discs around the coefficients, each for itself.

    Where the linear model of the margins fails, as beside an edge of the part, it shrinks at these places alone, and
    the rest of the path goes on.
    """

    radii: Floats
    options: TrustOptions = OPTIONS

    @classmethod
    def of(cls, count: int) -> TrustRegion:
        """Return the largest one, for `count` coefficients."""
        return cls(np.full(count, OPTIONS.largest))

    def is_used_up(self) -> bool:
        """Return whether none of the coefficients may move any more."""
        return float(self.radii.max()) < self.options.least

    def widen(self) -> None:
        """Double the radii, up to the largest."""
        self.radii = np.minimum(2.0 * self.radii, self.options.largest)

    def limit(self, radius: float) -> None:
        """Let no radius be larger than `radius`, which counts as the least one if it is smaller."""
        self.radii = np.minimum(self.radii, max(radius, self.options.least))

    def after(self, lengths: Floats, failing: Bools, *, good: bool) -> None:
        """Adapt to a step of `lengths` (K,) that was taken but for coefficients `failing` (K,).

        good: whether it brought about what it promised.
        """
        self.shrink(0.5 * lengths, failing)
        if good:
            self.widen()
        else:
            self.limit(0.5 * float(lengths.max()))

    def shrink(self, lengths: Floats | None = None, at: Bools | None = None) -> None:
        """Shrink the radii, or those of the coefficients `at` (K,), to a share of a step of `lengths` (K,) around."""
        around = self.radii
        if lengths is not None:
            around = np.maximum(maximum_filter1d(lengths, 2 * self.options.ramp + 1), self.options.least)
        shrunk = self.options.shrink * np.minimum(self.radii, around)
        self.radii = shrunk if at is None else np.where(at, shrunk, self.radii)

    def away_from(self, at: Bools) -> Floats:
        """Return shares (K,) of a step: 0 for the coefficients `at` (K,), and 1 far from them."""
        places, k = np.flatnonzero(at), np.arange(len(at))
        if not len(places):
            return np.ones(len(at))
        after = np.searchsorted(places, k)
        behind, ahead = places[np.maximum(after - 1, 0)], places[np.minimum(after, len(places) - 1)]
        share = np.minimum(np.minimum(abs(k - behind), abs(k - ahead)) / self.options.ramp, 1.0)
        return np.asarray(share * share * (3.0 - 2.0 * share), dtype=np.float64)
