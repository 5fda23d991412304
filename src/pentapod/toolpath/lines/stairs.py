"""Stairs of ends: how far apart passes of a bull-nose or flat end of fixed axis may be on slopes.

On a plane across its axis an end leaves nothing between passes. On a slope it leaves stairs. The end is a disc grown by
its corner's radius, and all above it. Cut by a plane at a height h₁ above a slope of angle θ, what is above the disc
is a segment of an ellipse: v from disc − h₁ / sin θ to disc uphill, seen along the axis, and v / cos θ along the slope.
The corner's ball adds its own chord at what is left of the height. Two passes leave the height at which this is as
wide, across them, as they are apart.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats

SHARES = 9
"""Ways in which a height is divided between disc and corner."""

LEAST = 1e-3
"""Sine or cosine of a slope below which it counts as level, or upright."""


def end_stepover(height: float, corner: float, disc: float, axis: Floats, normals: Floats, across: Floats) -> Floats:
    """Return the distance (N,) along planes, metres, between passes of an end that leave `height` metres.

    corner, disc: radii of the rounding and of the disc, metres. axis (3,): of the tool, unit. normals (N, 3): of the
    planes, unit. across (N, 3) or (3,): directions across the passes, projected on the planes; where a projection
    vanishes, the least distance of all directions is returned.
    """
    cosine = normals @ axis
    uphill = axis - cosine[:, None] * normals
    sine = np.linalg.norm(uphill, axis=1)
    flat = across - np.einsum("ij,ij->i", np.broadcast_to(across, normals.shape), normals)[:, None] * normals
    length = np.linalg.norm(flat, axis=1)
    known = (length > LEAST * np.linalg.norm(np.broadcast_to(across, normals.shape), axis=1)) & (sine > LEAST)
    share = np.abs(np.einsum("ij,ij->i", flat, uphill)) / np.where(known, length * sine, 1.0)
    along = np.where(known, np.minimum(share, 1.0), 1.0)
    aside = np.sqrt(np.maximum(1.0 - along**2, 0.0))
    sine, cosine = np.maximum(sine, LEAST), np.maximum(np.abs(cosine), LEAST)
    widest = np.zeros(len(normals))
    for low in np.linspace(0.0, height, SHARES):
        rest = min(height - low, corner)
        widest = np.maximum(widest, _width(low, disc, sine, cosine, along, aside) + 2.0 * _chord(rest, corner))
    return widest


def _width(height: float, disc: float, sine: Floats, cosine: Floats, along: Floats, aside: Floats) -> Floats:
    """Return the width (N,) across the passes of the segment at a height above the slope."""
    stretched = along / cosine
    first = np.maximum(disc - height / sine, -disc)
    half = np.sqrt(np.maximum(disc**2 - first**2, 0.0))
    full = np.hypot(stretched, aside)
    # The farthest point of the whole disc across the passes, if the segment holds it and its opposite.
    top = disc * stretched / full
    most = np.where(top >= first, disc * full, stretched * first + aside * half)
    least = np.where(-top >= first, -disc * full, stretched * first - aside * half)
    return most - least


def _chord(height: float, radius: float) -> float:
    return float(np.sqrt(max(height * (2.0 * radius - height), 0.0)))
