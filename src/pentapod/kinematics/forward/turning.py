"""How a point off a line turns about it until it has a given distance from a fixed point."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats

_ROUNDING = 16.0 * float(np.finfo(np.float64).eps)


def twist(seen: Floats, axis: Floats, arm: Floats) -> Floats:
    """Return seen · (axis × arm) (...): signed volume, zero where all three lie in a plane. Each (..., 3)."""
    return np.einsum("...k,...k->...", seen, np.cross(axis, arm))


def dihedral(seen: Floats, axis: Floats, radius: float, length: Floats, side: Floats) -> Floats:
    """Return the arm (..., 3) of the given radius, square to axis (..., 3): |seen + arm| = length, sign(twist) = side.

    seen (..., 3) leads from the fixed point to the foot of the arm on the line; all in metres. With h = seen · axis,
    M the distance of the fixed point from the line and λ² = length² − h², the arm, M and λ are a plane
    triangle: it exists where |M − radius| ≤ λ ≤ M + radius, rounding forgiven. NaN elsewhere, where side is 0 or
    NaN, and where M = 0.
    """
    height = np.einsum("...k,...k->...", seen, axis)
    across = seen - height[..., None] * axis
    distance = np.linalg.norm(across, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        reach = np.sqrt(np.maximum((length - height) * (length + height), 0.0))
        # 1 ∓ cos ψ = each of these by 2 M r: the half angle keeps its digits at both ends
        scale = distance + radius + reach
        outer = (distance + radius - reach) * scale
        inner = (reach - np.abs(distance - radius)) * (reach + np.abs(distance - radius))
        slack = _ROUNDING * np.square(scale + np.abs(height))
        exists = (outer >= -slack) & (inner >= -slack) & (np.abs(side) == 1.0) & (distance > 0.0)
        angle = 2.0 * np.arctan2(np.sqrt(np.maximum(outer, 0.0)), np.sqrt(np.maximum(inner, 0.0)))
        angle = np.where(exists & (length >= 0.0), -side * angle, np.nan)  # seen · (axis × arm) = −M r sin ψ
        towards = across / distance[..., None]
    return radius * (np.cos(angle)[..., None] * towards + np.sin(angle)[..., None] * np.cross(axis, towards))


def frame_of(axis: Floats, arm: Floats, azimuth: float) -> Floats:
    """Return rotations (..., 3, 3) from (0, 0, 1) to axis and (cos azimuth, sin azimuth, 0) to the arm's direction."""
    radial: Floats = arm / np.linalg.norm(arm, axis=-1, keepdims=True)
    tangential = np.cross(axis, radial)
    c, s = float(np.cos(azimuth)), float(np.sin(azimuth))
    first, second = c * radial - s * tangential, s * radial + c * tangential
    return np.stack([first, second, axis + 0.0 * arm], axis=-1)
