"""Legs that end on rings around the platform line: where they end, and what forces there do to the line, compiled."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import kernel


@kernel
def ring(p: Floats, i: Floats, base: Floats, radius: float, w: Floats) -> None:
    """Fill w (3, 3) with the way from the line to the end of a leg on a ring, and its derivatives, from those of p, i.

    base (3,): the leg's base joint. A derivative needs those of p and i (3, 3) up to its own order alone.
    """
    along, along1, along2, rho, rho1, rho2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for c in range(3):
        d = base[c] - p[0, c]
        along += d * i[0, c]
        along1 += d * i[1, c] - p[1, c] * i[0, c]
        along2 += d * i[2, c] - 2.0 * p[1, c] * i[1, c] - p[2, c] * i[0, c]
    for c in range(3):
        w[0, c] = base[c] - p[0, c] - along * i[0, c]
        w[1, c] = -p[1, c] - along1 * i[0, c] - along * i[1, c]
        w[2, c] = -p[2, c] - along2 * i[0, c] - 2.0 * along1 * i[1, c] - along * i[2, c]
        rho += w[0, c] * w[0, c]
    rho = np.sqrt(rho)
    for c in range(3):
        w[0, c] /= rho
        rho1 += w[0, c] * w[1, c]
    for c in range(3):
        rho2 += w[0, c] * w[2, c] + (w[1, c] - rho1 * w[0, c]) / rho * w[1, c]
    for c in range(3):
        w[1, c] = (w[1, c] - rho1 * w[0, c]) / rho
        w[2, c] = radius * (w[2, c] - rho2 * w[0, c] - 2.0 * rho1 * w[1, c]) / rho
        w[0, c], w[1, c] = radius * w[0, c], radius * w[1, c]


@kernel
def bend(e: Floats, i: Floats, w: Floats, radius: float) -> float:
    """Return what turning does to e · ẅ beside −(e·i) (w · ï), with the sign changed: e in the plane of i and w."""
    fast, lean, over, out = 0.0, 0.0, 0.0, 0.0
    for c in range(3):
        fast += w[1, c] * w[1, c]
        lean += i[1, c] * w[1, c]
        over += e[c] * i[0, c]
        out += e[c] * w[0, c]
    return out * fast / radius**2 + 2.0 * over * lean


@kernel
def at_ring(side: Floats, base: Floats, p: Floats, i: Floats, w: Floats, at_p: Floats, at_i: Floats) -> None:
    """Add to at_p and at_i (3, 3) what forces (3, 3) on the end of a leg do by the turning of its ring w (3,)."""
    radius, along, rho = 0.0, 0.0, 0.0
    for c in range(3):
        radius += w[c] * w[c]
        along += (base[c] - p[c]) * i[c]
    for c in range(3):
        rho += (base[c] - p[c] - along * i[c]) ** 2
    share, radius = np.sqrt(radius / rho), np.sqrt(radius)
    for n in range(3):
        outward, lean = 0.0, 0.0
        for c in range(3):
            outward += side[n, c] * w[c] / radius
        for c in range(3):
            lean += (side[n, c] - outward * w[c] / radius) * i[c]
        for c in range(3):
            across = side[n, c] - outward * w[c] / radius
            at_p[n, c] -= share * (across - lean * i[c])
            at_i[n, c] -= share * (lean * (base[c] - p[c]) + along * across)
