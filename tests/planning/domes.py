"""Toolpaths over a dome."""

from __future__ import annotations

import numpy as np

from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath


def dome(size: float, slope_deg: float, waypoints: int = 400, tilt_centre: float = 0.003) -> Toolpath:
    """A zigzag over a spherical cap `size` metres wide with slopes to slope_deg at its rim."""
    half = 0.5 * size
    rows = max(6, int(np.sqrt(waypoints) / 2))
    passes = []
    for k, y in enumerate(np.linspace(-0.97 * half, 0.97 * half, rows)):
        width = np.sqrt(half * half - y * y)
        x = np.linspace(-width, width, waypoints // rows)
        passes.append(np.stack([x if k % 2 == 0 else x[::-1], np.full_like(x, y)], axis=1))
    xy = np.concatenate(passes)
    radius = half / np.sin(np.radians(slope_deg))
    z = np.sqrt(radius**2 - (xy**2).sum(axis=1))
    return Toolpath(
        (Segment(SegmentKind.CUT, np.c_[xy, z - radius], np.c_[xy, z] / radius, 0.02),),
        tilt_centre,
    )
