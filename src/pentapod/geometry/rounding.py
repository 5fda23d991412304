"""A C2 curve through a polyline, its corners rounded within a tolerance.

The curve is Schoenberg's variation-diminishing cubic spline of the polyline: its control points are the
polyline's own points at the knots' averages. It reproduces straight stretches exactly, never overshoots,
and approaches the polyline as the knots get denser; so knots are halved wherever it is too far away.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import BSpline

from pentapod.arrays import Bools, Floats
from pentapod.errors import ArrayError

HALVINGS = 40
_INSIDE = np.array([0.0, 0.25, 0.5, 0.75, 1.0])


def rounded(parameter: Floats, points: Floats, too_far: Callable[[Floats, Floats, Floats], Bools]) -> BSpline:
    """Return a clamped C2 cubic spline near the polyline of points (N, D) at parameters (N,), ends exact.

    too_far(u, on_curve, on_polyline) says for parameters (K,) and values (K, D) where the curve is beyond its
    tolerance. The polyline is linear between parameters, which must increase strictly. Raises ArrayError
    where they do not, or where no number of halvings brings the curve near enough.
    """
    if len(parameter) < 2 or not (np.diff(parameter) > 0.0).all():
        raise ArrayError("parameters must increase strictly and be at least two")
    knots = parameter
    for _ in range(HALVINGS):
        curve = schoenberg(knots, parameter, points)
        u = knots[:-1, None] + _INSIDE * np.diff(knots)[:, None]
        far = too_far(u.ravel(), curve(u.ravel()), interpolated(u.ravel(), parameter, points)).reshape(u.shape)
        spans = far.any(axis=1)
        if not spans.any():
            return curve
        knots = np.sort(np.concatenate([knots, 0.5 * (knots[:-1] + knots[1:])[spans]]))
    raise ArrayError("the tolerance is too small for the spacing of numbers", value=float(np.diff(knots).min()))


def schoenberg(knots: Floats, parameter: Floats, points: Floats) -> BSpline:
    """Return Schoenberg's cubic spline of the polyline (parameter, points) on clamped simple knots (K,)."""
    t = np.concatenate([np.full(3, knots[0]), knots, np.full(3, knots[-1])])
    averages = (t[1:-3] + t[2:-2] + t[3:-1]) / 3.0
    return BSpline(t, interpolated(averages, parameter, points), 3)


def interpolated(u: Floats, parameter: Floats, points: Floats) -> Floats:
    """Return the polyline (K, D) at parameters u (K,)."""
    k = np.clip(np.searchsorted(parameter, u, side="right") - 1, 0, len(parameter) - 2)
    share = ((u - parameter[k]) / (parameter[k + 1] - parameter[k]))[:, None]
    return points[k] + share * (points[k + 1] - points[k])
