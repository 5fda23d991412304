"""Paths of SVG as text: polylines in tenths of a unit, and heads of arrows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pentapod.base.arrays import Floats

ARROW = 6.0
"""Length of an arrow's head."""


def arrow_head(x: float, y: float, dx: float, dy: float) -> str:
    """Return an arrow's head at a place, pointing along (dx, dy)."""
    length = max(float(np.hypot(dx, dy)), 1e-9)
    ux, uy = ARROW * dx / length, ARROW * dy / length
    a, b = (x - ux - 0.3 * uy, y - uy + 0.3 * ux), (x - ux + 0.3 * uy, y - uy - 0.3 * ux)
    return f'<path d="M{x:.1f} {y:.1f}L{a[0]:.1f} {a[1]:.1f}L{b[0]:.1f} {b[1]:.1f}Z" fill="currentColor"/>'


def path_through(lines: Sequence[Floats], close: str = "") -> str:
    """Return an SVG path of lines (K, 2): where each begins, then the way from point to point, in tenths of a unit."""
    texts: list[str] = []
    for line in lines:
        places = np.round(10.0 * line).astype(np.int64)
        keep = np.concatenate([[True], (np.diff(places, axis=0) != 0).any(axis=1)])
        if int(keep.sum()) < 2:
            continue
        places = places[keep]
        steps = np.diff(places, axis=0) / 10.0
        start = places[0] / 10.0
        way = "".join(f"{dx:g} {dy:g} " if dy >= 0 else f"{dx:g}{dy:g} " for dx, dy in steps.tolist())
        texts.append(f"M{start[0]:g} {start[1]:g}l{way.strip()}{close}")
    return "".join(texts)
