"""Material left along the path: what is left on the surface beside it, for each key of the motion."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.polyline import arc_length
from pentapod.numerics.threads import nearest_points
from pentapod.planning import PlacedPath
from pentapod.report.signals import Signals
from pentapod.verify.verdict.material_left import MaterialLeft

STEP_M, MOST_STEPS = 4e-3, 4000
"""Way of the tip between two keys, so that straight passes show where material is left; at most so many of them."""
ROWS = 200_000
"""Rows on cuts among which the nearest to a point is looked for, about."""


def marked_along(signals: Signals) -> Bools:
    """Return rows (N,) that begin a step along the path: keys of which each is within one step."""
    return np.concatenate([[False], np.diff(_steps(signals)) > 0])


def left_at(signals: Signals, placed: PlacedPath, rows: Ints, left: MaterialLeft) -> Floats:
    """Return the largest height (K,) of what is left beside the step of each key, and beside its two neighbours.

    A point counts for the row on a cut that is nearest to it. One step alone has few points: some would miss the ridge
    between two passes. Where no point counts, it is the height of the point nearest to the key.
    """
    from scipy.spatial import KDTree  # noqa: PLC0415  only where there is such a map

    def centres(of: Ints) -> Floats:
        moved = signals.tips[of] + placed.toolpath.tilt_centre * signals.axes[of]
        return placed.placement.transform.inverse().apply(moved)

    heights = left.heights[nearest_points(KDTree(left.points), centres(rows))[1]]
    cuts = np.flatnonzero(signals.cutting)
    cuts = cuts[:: max(1, len(cuts) // ROWS)]
    if len(cuts):
        steps = _steps(signals)
        most = np.full(steps[-1] + 3, -np.inf)
        np.maximum.at(most, 1 + steps[cuts[nearest_points(KDTree(centres(cuts)), left.points)[1]]], left.heights)
        around = np.max([most[:-2], most[1:-1], most[2:]], axis=0)[steps[rows]]
        heights = np.where(np.isfinite(around), around, heights)
    return np.asarray(heights, dtype=np.float64)


def _steps(signals: Signals) -> Ints:
    """Return in which step along the path, of about the same length each, the rows (N,) are."""
    along = arc_length(signals.tips)
    return np.floor(along / max(STEP_M, float(along[-1]) / MOST_STEPS)).astype(np.intp)
