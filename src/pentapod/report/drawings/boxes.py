"""Boxes of labels: where a text stands, how much two have in common, and how much of a line runs through one."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats

LETTER = 11.0
"""Height of letters, in units of the drawing; a unit is a CSS pixel where the drawing is as wide as it was made."""

LETTER_WIDTH = 0.65
"""Width of a letter as a share of its height, rather too much."""

Box = tuple[float, float, float, float]
"""Left, upper, right, lower edge, in units of the drawing."""


Place = tuple[float, float, str]
"""Where a label may stand: x and y of its base line, and which point of it that is ("start", "middle", "end")."""


def box_of(place: Place, text: str) -> Box:
    """Return the box of a text at a place."""
    x, y, anchor = place
    wide = width_of(text)
    left = x - {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor] * wide
    return (left, y - 0.85 * LETTER, left + wide, y + 0.25 * LETTER)


def width_of(text: str) -> float:
    """Return how wide a text is at most."""
    return LETTER_WIDTH * LETTER * len(text)


def size(box: Box) -> float:
    """Return the area of a box."""
    return (box[2] - box[0]) * (box[3] - box[1])


def common(a: Box, b: Box) -> float:
    """Return the area that two boxes have in common."""
    wide, high = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
    return max(wide, 0.0) * max(high, 0.0)


def through(box: Box, lines: Floats) -> float:
    """Return the length of straight lines (K, 2, 2), from and to, within a box (Liang and Barsky's clipping)."""
    start, way = lines[:, 0], lines[:, 1] - lines[:, 0]
    low, high = np.array(box[:2]), np.array(box[2:])
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (low - start) / way, (high - start) / way
    still, beside = way == 0.0, (start < low) | (start > high)
    enters = np.where(still, np.where(beside, np.inf, -np.inf), np.minimum(a, b)).max(axis=1)
    leaves = np.where(still, np.where(beside, -np.inf, np.inf), np.maximum(a, b)).min(axis=1)
    share = np.clip(np.minimum(leaves, 1.0) - np.maximum(enters, 0.0), 0.0, None)
    return float((share * np.linalg.norm(way, axis=1)).sum())
