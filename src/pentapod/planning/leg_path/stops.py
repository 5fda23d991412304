"""Exact stops of a leg path at sharp corners."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.planning.leg_path.tool_curve import REORIENTATION_LEVER_M


def with_corners(stops: Bools, u: Floats, points: Floats, tilt_centre: float, angle: float, near: Floats) -> Bools:
    """Return stops at inner waypoints (N − 2,) with those at sharp corners, which turn by more than an angle, radians.

    points (N, 6): tilt centres and axes, at stations u (N,). near (N,): waypoints that are not farther apart are one
    corner, however little each of them turns. A tip that a ball keeps on an edge goes to and fro by micrometres: it has
    a corner only where its path has one together with that of the axis.
    """
    tilt_centres, axes = points[:, :3], points[:, 3:]
    ways = tilt_centres, np.hstack([tilt_centres - tilt_centre * axes, REORIENTATION_LEVER_M * axes])
    inner = np.arange(1, len(u) - 1)
    stops = stops | _turns(ways[0], inner - 1, inner + 1, angle) | _turns(ways[1], inner - 1, inner + 1, angle)
    before = np.maximum(np.searchsorted(u, u - near, "right") - 1, 0)[1:-1]
    after = np.minimum(np.searchsorted(u, u + near), len(u) - 1)[1:-1]
    corners = _turns(ways[0], before, after, angle) | _turns(ways[1], before, after, angle)
    for k in np.flatnonzero(corners & ~stops).tolist():
        stops[k] = not stops[before[k] : after[k] - 1].any()
    return stops


def _turns(points: Floats, before: Ints, after: Ints, angle: float) -> Bools:
    """Return for each inner point (N − 2,) of a polyline whether it turns by more than an angle between two others."""
    into, out = points[1:-1] - points[before], points[after] - points[1:-1]
    lengths = np.linalg.norm(into, axis=1), np.linalg.norm(out, axis=1)
    sharp = (into * out).sum(axis=1) < np.cos(angle) * lengths[0] * lengths[1]
    return sharp & (lengths[0] > 1e-9) & (lengths[1] > 1e-9)
