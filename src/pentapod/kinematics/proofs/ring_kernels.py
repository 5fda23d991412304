"""Legs that end on rings around the platform line, in Krawczyk's operator: what −r ρ adds, compiled.

ρ = |N|, N = d × i, d = p − a, is the distance of a base joint from the line. Along a straight line of poses N is a
quadratic, |ρ''| ≤ |N''| + |N'|² / ρ, so ρ is within an eighth of that from the straight line between its ends. For
changes (δd, δi) and (v_d, v_i), of which N changes by δN and v_N, the second derivative of ρ is at most
|δN| |v_N| / ρ + |δd| |v_i| + |v_d| |δi|.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import kernel

_NEAREST = 1.0 / 16.0
"""ρ / |d| below which nothing is proven: rounding would have to be bounded more closely."""


@kernel
def ring_line(
    first: Floats, second: Floats, start: Floats, end: Floats, offset: float, radius: float, row: Floats, ring: Floats
) -> None:
    """Add −r ∇ρ to the Jacobian's row (6,) in the middle; fill ring (8,) for one leg.

    first, second (3,): the vectors from the base joint to the ring's centre at both ends. ring: ρ at start and end and
    in the middle, |d| in the middle, the largest |ρ''| on the line, and the unit vector (3,) from the base joint's
    side of the ring to its centre in the middle, by which −r is what the leg's vector differs from the centre's.
    """
    i0, i1 = start[3:], end[3:]
    ring[0] = _length(_cross(first, i0))
    ring[1] = _length(_cross(second, i1))
    i, d, shift, turn = 0.5 * (i0 + i1), np.empty(3), np.empty(3), np.empty(3)
    for n in range(3):
        d[n] = 0.5 * (first[n] + second[n]) - offset * i[n]
        shift[n], turn[n] = end[n] - start[n], i1[n] - i0[n]
    normal = _cross(d, i)
    ring[2], ring[3] = _length(normal), _length(d)
    moved, turned = _length(shift), _length(turn)
    change = 1.0001 * moved + (ring[3] + moved) * turned
    nearest = ring[2] - 0.5 * change
    ring[4] = 2.0 * moved * turned + change * change / nearest if nearest > _NEAREST * ring[3] else np.inf
    normal /= ring[2]
    by_position, by_direction = _cross(i, normal), _cross(normal, d)
    for n in range(3):
        row[n] -= radius * by_position[n]
        row[3 + n] -= radius * by_direction[n]
        ring[5 + n] = by_position[n]


@kernel
def ring_bend(ring: Floats, region: tuple[float, float], change: tuple[float, float], v: tuple[float, float]) -> float:
    """Return the largest second derivative of ρ for changes (|d|, |i|) and v, in a region so large about the middle."""
    far, unit = ring[3] + region[0], 1.0001 + region[1]
    nearest = ring[2] - region[0] * unit - far * region[1]
    if not nearest > _NEAREST * far:
        return np.inf
    both = (change[0] * unit + far * change[1]) * (v[0] * unit + far * v[1]) / nearest
    return both + change[0] * v[1] + v[0] * change[1]


@kernel
def ring_swing(ring: Floats, region: tuple[float, float]) -> float:
    """Return how far the unit vector of `ring_line` is from that in the middle, at most, in such a region."""
    change = region[0] * (1.0001 + region[1]) + (ring[3] + region[0]) * region[1]
    return region[1] + 2.0 * change / ring[2]


@kernel
def _cross(a: Floats, b: Floats) -> Floats:
    out = np.empty(3)
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    return out


@kernel
def _length(a: Floats) -> float:
    return np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
