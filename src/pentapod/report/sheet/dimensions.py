"""Dimension lines of a drawing: the part's extents in mm, and where its edges are in the machine."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats

LETTER, ARM, GAP = 13.0, 5.0, 18.0
"""Height of letters, half length of the strokes at the ends, and distance from the part, in units of the drawing."""


def dimension_lines(box: Floats, low: Floats, high: Floats, unit: float, names: tuple[str, str]) -> str:
    """Return the lines below and beside a box, as SVG.

    box (2, 2): its corners in the drawing, right and down. low, high (2,): coordinates in the machine at its left,
    upper and right, lower edges, mm. unit: 1/500 of the drawing; names: of the axes.
    """
    (left, top), (right, bottom) = box
    below, beside = bottom + GAP * unit, right + GAP * unit
    width, height = np.abs(high - low)
    return "".join([
        _line((left, below), (right, below), unit),
        _text(0.5 * (left + right), below - 4.0 * unit, f"{width:.2f}", unit),
        _text(left, below + LETTER * unit, f"{names[0]} {_number(low[0])}", unit),
        _text(right, below + LETTER * unit, f"{names[0]} {_number(high[0])}", unit),
        _line((beside, top), (beside, bottom), unit),
        _text(beside + 4.0 * unit, 0.5 * (top + bottom), f"{height:.2f}", unit, "start"),
        _text(beside + 4.0 * unit, top + 0.4 * LETTER * unit, f"{names[1]} {_number(low[1])}", unit, "start"),
        _text(beside + 4.0 * unit, bottom, f"{names[1]} {_number(high[1])}", unit, "start"),
    ])  # fmt: skip


def _number(value: float) -> str:
    return f"{round(float(value), 2) + 0.0:.2f}".replace("-", "−")


def _line(start: tuple[float, float], end: tuple[float, float], unit: float) -> str:
    """Return a line with a stroke across each end."""
    (x0, y0), (x1, y1), arm = start, end, ARM * unit
    across = (0.0, arm) if y0 == y1 else (arm, 0.0)
    strokes = "".join(
        f"M{x - across[0]:.1f},{y - across[1]:.1f}L{x + across[0]:.1f},{y + across[1]:.1f}" for x, y in (start, end)
    )
    return (
        f'<path d="M{x0:.1f},{y0:.1f}L{x1:.1f},{y1:.1f}{strokes}" fill="none" stroke="currentColor" '
        f'stroke-width="{unit:.2f}"/>'
    )


def _text(x: float, y: float, text: str, unit: float, anchor: str = "middle") -> str:
    return (
        f'<text class="dimension" x="{x:.1f}" y="{y:.1f}" font-size="{LETTER * unit:.1f}" text-anchor="{anchor}" '
        f'fill="currentColor">{text}</text>'
    )
