"""Rotary angles of five-axis G-code (A and B, B and C) and tool axes, degrees.

XYZAB, as LinuxCNC's pentakins and other machines with A and B heads have it: R = Ry(B) Rx(A), so that the axis from the
tip to the spindle is (cos A sin B, −sin A, cos A cos B). XYZBC: R = Rz(C) Ry(B), (sin B cos C, sin B sin C, cos B).
Angles are the nearest to those of the pose before, so that no rotary axis jumps by a turn. Where the tool axis is at a
pole (B = 0 of XYZBC, A = ±90° of XYZAB) the undefined angle keeps its last value.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats

POLE = 1e-9
"""Sine of the angle from a pole up to which the other rotary angle is undefined."""


@dataclass(frozen=True)
class Rotary:
    """words: the two letters. axis: angles (..., 2) in degrees → axes (..., 3). angles: axes (N, 3) → angles (N, 2)."""

    words: tuple[str, str]
    axis: Callable[[Floats], Floats]
    angles: Callable[[Floats], Floats]


def _axis_ab(angles: Floats) -> Floats:
    a, b = np.radians(angles[..., 0]), np.radians(angles[..., 1])
    return np.stack([np.cos(a) * np.sin(b), -np.sin(a), np.cos(a) * np.cos(b)], axis=-1)


def _axis_bc(angles: Floats) -> Floats:
    b, c = np.radians(angles[..., 0]), np.radians(angles[..., 1])
    return np.stack([np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)], axis=-1)


def _angles_ab(axes: Floats) -> Floats:
    x, y, z = axes.T
    level = np.hypot(x, z)
    return np.degrees(np.stack([np.arctan2(-y, level), _continued(np.arctan2(x, z), level)], axis=1))


def _angles_bc(axes: Floats) -> Floats:
    x, y, z = axes.T
    level = np.hypot(x, y)
    return np.degrees(np.stack([np.arctan2(level, z), _continued(np.arctan2(y, x), level)], axis=1))


def _continued(angle: Floats, level: Floats) -> Floats:
    """Return angles (N,) without jumps by a turn; where `level` (N,) is almost 0, the one before."""
    known = np.flatnonzero(level > POLE)
    if not len(known):
        return np.zeros_like(angle)
    last = known[np.clip(np.searchsorted(known, np.arange(len(angle)), side="right") - 1, 0, None)]
    return np.unwrap(angle[last])


AB = Rotary(("A", "B"), _axis_ab, _angles_ab)
BC = Rotary(("B", "C"), _axis_bc, _angles_bc)
