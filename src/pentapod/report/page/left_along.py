"""Material left along the path: at each key, what is left on the surface beside the path from there to the next key."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.polyline import arc_length
from pentapod.planning import PlacedPath
from pentapod.report.signals import Signals
from pentapod.verify.verdict.material_left import MaterialLeft

NEAR_M, MOST_KEYS = 4e-3, 4000
"""Way of the tip between two keys, so that straight passes show where material is left; at most so many of them."""
ROWS = 200_000
"""Rows on cuts among which the nearest to a point is looked for, about."""


def marked_along(signals: Signals) -> Bools:
    """Return rows (N,) at about even distances along the path, which keys need to show places along it."""
    along = arc_length(signals.tips)
    step = max(NEAR_M, float(along[-1]) / MOST_KEYS)
    return np.concatenate([[False], np.diff(np.floor(along / step)) > 0.0])


def left_at(signals: Signals, placed: PlacedPath, rows: Ints, left: MaterialLeft) -> Floats:
    """Return the largest height (K,) of what is left from each key to the next, at the points nearest to rows there.

    Where no point is nearest to any of these rows, it is that of the point nearest to the key.
    """
    from scipy.spatial import KDTree  # noqa: PLC0415  only where there is such a map

    def centres(of: Ints) -> Floats:
        moved = signals.tips[of] + placed.toolpath.tilt_centre * signals.axes[of]
        return placed.placement.transform.inverse().apply(moved)

    heights = left.heights[KDTree(left.points).query(centres(rows))[1]]
    cuts = np.flatnonzero(signals.cutting)
    cuts = cuts[:: max(1, len(cuts) // ROWS)]
    if len(cuts):
        most = np.full(len(signals.tips), -np.inf)
        np.maximum.at(most, cuts[KDTree(centres(cuts)).query(left.points)[1]], left.heights)
        most = np.maximum.reduceat(most, rows)
        heights = np.where(np.isfinite(most), most, heights)
    return np.asarray(heights, dtype=np.float64)
