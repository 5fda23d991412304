"""Leg lengths and their derivatives, compiled.

`lengths` has the operations of `FiveLegs.leg_lengths` in the same order: equal to the last bit.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import kernel

_LANES = 64  # poses at a time: their columns become vector instructions


@kernel
def lengths(position: Floats, direction: Floats, base: Floats, offsets: Floats, legs: Floats) -> None:
    """Fill legs (N, 5) for position and direction (N, 3), base (5, 2) and offsets (5,)."""
    count = len(position)
    pose, found = np.empty((6, _LANES)), np.empty((5, _LANES))
    pose[:] = 0.0
    for start in range(0, count, _LANES):
        lanes = min(_LANES, count - start)
        for k in range(lanes):
            for j in range(3):
                pose[j, k] = position[start + k, j]
                pose[3 + j, k] = direction[start + k, j]
        for leg in range(5):
            x, y, z = base[leg, 0], base[leg, 1], offsets[leg]
            for k in range(_LANES):
                dx = z * pose[3, k] + (pose[0, k] - x)
                dy = z * pose[4, k] + (pose[1, k] - y)
                dz = z * pose[5, k] + pose[2, k]
                found[leg, k] = np.sqrt((dx * dx + dy * dy) + dz * dz)
        for k in range(lanes):
            for leg in range(5):
                legs[start + k, leg] = found[leg, k]


@kernel
def readings_along(
    tips: Floats, axes: Floats, base: Floats, levers: Floats, radii: Floats, zeros: Floats, legs: Floats
) -> None:
    """Fill legs (K, n, L) with readings and their derivatives of the orders below K ≤ 4 along a curve.

    tips, axes (K, n, 3): derivatives of the tip and of the tool axis (tip → spindle). base (L, 3); levers (L,): from
    the tip to the platform joints, along the axis. radii, zeros (L,) as in `LegsOnRings`. With e from the base joint to
    the middle of the ring and ρ = |e × axis|, the length's square is |e|² − 2 r ρ + r²; Leibniz's rule gives the rest.
    """
    orders = len(tips)
    e, a, normal = np.zeros((4, 3)), np.zeros((4, 3)), np.empty((4, 3))
    for k in range(tips.shape[1]):
        for n in range(orders):
            for c in range(3):
                a[n, c] = axes[n, k, c]
        for leg in range(len(base)):
            for n in range(orders):
                for c in range(3):
                    e[n, c] = tips[n, k, c] + levers[leg] * a[n, c]
            for c in range(3):
                e[0, c] -= base[leg, c]
            square = _squared(e)
            radius = radii[leg]
            if radius > 0.0:
                for c in range(3):
                    d, f = (c + 1) % 3, (c + 2) % 3
                    normal[0, c] = e[0, d] * a[0, f] - e[0, f] * a[0, d]
                    normal[1, c] = e[0, d] * a[1, f] - e[0, f] * a[1, d] + e[1, d] * a[0, f] - e[1, f] * a[0, d]
                    normal[2, c] = e[0, d] * a[2, f] - e[0, f] * a[2, d] + e[2, d] * a[0, f] - e[2, f] * a[0, d]
                    normal[2, c] += 2.0 * (e[1, d] * a[1, f] - e[1, f] * a[1, d])
                    normal[3, c] = e[0, d] * a[3, f] - e[0, f] * a[3, d] + e[3, d] * a[0, f] - e[3, f] * a[0, d]
                    normal[3, c] += 3.0 * (e[1, d] * a[2, f] - e[1, f] * a[2, d])
                    normal[3, c] += 3.0 * (e[2, d] * a[1, f] - e[2, f] * a[1, d])
                rho = _root(_squared(normal))
                square = (
                    square[0] - 2.0 * radius * rho[0] + radius * radius,
                    square[1] - 2.0 * radius * rho[1],
                    square[2] - 2.0 * radius * rho[2],
                    square[3] - 2.0 * radius * rho[3],
                )
            length = _root(square)
            legs[0, k, leg] = length[0] + zeros[leg]
            for n in range(1, orders):
                legs[n, k, leg] = length[n]


@kernel
def _squared(e: Floats) -> tuple[float, float, float, float]:
    """Return |e|² and its derivatives, e (4, 3) a vector and its derivatives."""
    s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
    for c in range(3):
        s0 += e[0, c] * e[0, c]
        s1 += 2.0 * e[0, c] * e[1, c]
        s2 += 2.0 * (e[1, c] * e[1, c] + e[0, c] * e[2, c])
        s3 += 6.0 * e[1, c] * e[2, c] + 2.0 * e[0, c] * e[3, c]
    return s0, s1, s2, s3


@kernel
def _root(square: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """Return the square root and its derivatives."""
    r0 = np.sqrt(square[0])
    r1 = 0.5 * square[1] / r0
    r2 = (0.5 * square[2] - r1 * r1) / r0
    return r0, r1, r2, (0.5 * square[3] - 3.0 * r1 * r2) / r0
