"""Terms −r ρ of legs that end on rings around the platform line, for Krawczyk's operator, compiled.

ρ = |N|, N = d × i, d = p − a, is the distance of a base joint from the line. Along a straight line of poses and within
a box the changes of ρ are bounded by its first and second derivatives: lemma 15 of docs/proofs.md.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import kernel

Triple: TypeAlias = tuple[float, float, float]

NEAREST = 1.0 / 16.0
"""ρ / |d| below which nothing is proven: nearer to the line, rounding would need a closer bound."""

LONGEST_DIRECTION = 1.0001
"""No direction on the line of poses is longer: both ends have length 1, to rounding."""


@kernel
def ring_line(
    first: Floats, second: Floats, start: Floats, end: Floats, offset: float, row: Floats, ring: Floats
) -> None:
    """Add −r ∇ρ in the middle of the line to the Jacobian's row (6,); fill ring (9,) for one leg.

    first, second (3,): the vectors from the base joint to the ring's centre at both ends. ring: ρ at the start, at the
    end and in the middle, |d| in the middle, a bound of |ρ'''| on the line, and the unit vector (3,) in the middle
    along which the ring's centre is r farther than the point where the leg ends; last r, which is given.
    """
    i0, i1 = (start[3], start[4], start[5]), (end[3], end[4], end[5])
    f0, f1 = (first[0], first[1], first[2]), (second[0], second[1], second[2])
    ring[0] = length(cross(f0, i0))
    ring[1] = length(cross(f1, i1))
    i = 0.5 * (i0[0] + i1[0]), 0.5 * (i0[1] + i1[1]), 0.5 * (i0[2] + i1[2])
    d = (
        0.5 * (f0[0] + f1[0]) - offset * i[0],
        0.5 * (f0[1] + f1[1]) - offset * i[1],
        0.5 * (f0[2] + f1[2]) - offset * i[2],
    )
    normal = cross(d, i)
    ring[2], ring[3] = length(normal), length(d)
    moved = length((end[0] - start[0], end[1] - start[1], end[2] - start[2]))
    turned = length((i1[0] - i0[0], i1[1] - i0[1], i1[2] - i0[2]))
    change = LONGEST_DIRECTION * moved + (ring[3] + moved) * turned
    nearest = ring[2] - 0.5 * change
    ring[4] = np.inf
    if nearest > NEAREST * ring[3]:
        ring[4] = 3.0 * change / nearest * (2.0 * moved * turned + change * change / nearest)
    unit = normal[0] / ring[2], normal[1] / ring[2], normal[2] / ring[2]
    by_position, by_direction = cross(i, unit), cross(unit, d)
    for n in range(3):
        row[n] -= ring[8] * by_position[n]
        row[3 + n] -= ring[8] * by_direction[n]
        ring[5 + n] = by_position[n]


@kernel
def ring_bend(ring: Floats, region: tuple[float, float], change: tuple[float, float], v: tuple[float, float]) -> float:
    """Return a bound of ρ's second derivative for changes of these lengths (of d, of i), v being the other one.

    region: by how much d and i may differ from those in the middle. Infinite where the base joint may be too near.
    """
    far, unit = ring[3] + region[0], LONGEST_DIRECTION + region[1]
    nearest = ring[2] - region[0] * unit - far * region[1]
    if not nearest > NEAREST * far:
        return np.inf
    both = (change[0] * unit + far * change[1]) * (v[0] * unit + far * v[1]) / nearest
    return both + change[0] * v[1] + v[0] * change[1]


@kernel
def ring_swing(ring: Floats, region: tuple[float, float]) -> float:
    """Return a bound of how far the unit vector of `ring_line` gets from that in the middle, within the region."""
    change = region[0] * (LONGEST_DIRECTION + region[1]) + (ring[3] + region[0]) * region[1]
    return region[1] + 2.0 * change / ring[2]


@kernel
def norm(a: Floats) -> float:
    """Return the length of a vector (3,)."""
    return length((a[0], a[1], a[2]))


@kernel
def length(a: Triple) -> float:
    """Return the length of a vector in three numbers: they need no memory of their own."""
    return np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@kernel
def cross(a: Triple, b: Triple) -> Triple:
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
