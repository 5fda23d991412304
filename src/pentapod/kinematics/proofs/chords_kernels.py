"""The proof of `pentapod.kinematics.proofs.chords`, one chord after the other, compiled.

Its bounds are computed in ordinary floating point; an allowance that exceeds the rounding (`ROUND`) is added to each.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.kinematics.proofs.krawczyk_kernels import (
    ROUND,
    angle_within,
    contracted,
    enclosed,
    fill_defect,
    fill_line,
    fill_spread,
    inflated,
    invert,
    ring_region,
    sided,
)
from pentapod.kinematics.proofs.ring_kernels import norm, ring_bend, ring_swing
from pentapod.numerics.kernels import kernel

RING_VALUE, RING_SLOPE = 0.00802, 0.5
"""Shares of max |ρ'''| by which the quadratic polynomial and its derivative may be off: lemma 15 of docs/proofs.md."""


@kernel
def chords(
    legs: Floats,
    start: Floats,
    end: Floats,
    geometry: Floats,
    rings: Floats | None,
    signs: Floats,
    offsets: Floats,
    base_axes: Floats,
    bases: tuple[Floats, Floats, Floats, Floats],
    found: tuple[Bools, Floats, Floats, Floats, Floats, Floats],
) -> None:
    """Fill what `Chords` holds, in its order, for legs (H, 5, k + 1) and poses `start`, `end` (H, 6).

    geometry (6, 4), rings: as in `krawczyk_kernels`. bases: products (k + 1, k + 1), what l_a l_b contributes to
    coefficient a + b of l²; matrices that elevate from degree 2 to 2k, from 1 to k, and from 2 to max(k, 2), the last
    with further rows for k to max(k, 2).
    """
    products, squares_up, lines_up, cosines_up = bases
    proven, deviations, angles, speeds, base_cosines, platform_cosines = found
    k = legs.shape[2] - 1
    first, second, change, step = np.empty((5, 3)), np.empty((5, 3)), np.empty((5, 3)), np.empty(6)
    jacobian, inverse, work, defect = np.zeros((6, 6)), np.empty((6, 6)), np.empty((6, 12)), np.empty((6, 6))
    spread, spread_i = np.empty((5, 3)), np.empty(3)
    residual, e, de = np.empty((6, 2 * k + 1)), np.empty((6, 2 * k + 1)), np.empty((6, 2 * k))
    slack, y, z, bound, off = np.empty(6), np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    for h in range(len(legs)):
        proven[h], angles[h], deviations[h], speeds[h] = False, np.inf, np.inf, np.inf
        base_cosines[h], platform_cosines[h, :, 0], platform_cosines[h, :, 1] = -1.0, -1.0, 1.0
        if not sane(legs[h], start[h], end[h]):
            continue
        fill_line(start[h], end[h], geometry, first, second, change, step, jacobian, rings)
        if not invert(jacobian, work, inverse):
            continue
        fill_defect(inverse, jacobian, defect)
        line_residuals(legs[h], start[h], end[h], first, second, rings, squares_up, products, residual)
        line_corrections(inverse, residual, geometry[5, 2], rings, e, slack, y)
        if not enclosed(y, inverse, defect, geometry, rings, change, step, spread, spread_i, z, bound):
            continue
        if not sided(start[h], end[h], bound, signs, geometry):
            continue
        proven[h] = True
        # The solution is known to be this near: with the smaller box the bounds become closer.
        fill_spread(geometry, change, step, bound, spread, spread_i)
        contracted(inverse, defect, geometry, rings, spread, spread_i, bound, z)
        bounded = _derivatives(
            e, slack, bound, inverse, defect, geometry, rings, change, step, spread, spread_i, de, off
        )
        z += slack
        for a in range(len(offsets)):
            deviations[h, a] = _farthest(e, step, 0.0, offsets[a]) + _joined(z, abs(offsets[a]))
            if bounded:
                speeds[h, a] = _farthest(de, step, 1.0, offsets[a]) + _joined(off, abs(offsets[a]))
        largest = 0.0
        for m in range(2 * k + 1):
            largest = max(largest, e[3, m] ** 2 + e[4, m] ** 2 + e[5, m] ** 2)
        angles[h] = angle_within(np.sqrt(largest) + np.sqrt(z[3] ** 2 + z[4] ** 2 + z[5] ** 2))
        swing = np.sqrt(bound[3] ** 2 + bound[4] ** 2 + bound[5] ** 2)
        start_i, end_i = start[h, 3:], end[h, 3:]
        for j in range(5):
            own, one, two = legs[h, j], first[j], second[j]
            shortest = own.min()
            shift, rounding = _joined(bound, abs(geometry[j, 3])), 4.0 * ROUND * geometry[5, 2] / shortest
            aside, off_ring, radius = 0.0, 0.0, 0.0
            if rings is not None:
                radius = rings[j, 8]
                if radius > 0.0:
                    off_ring = radius * _dot(rings[j, 5:], base_axes[j])
                    aside = radius * ring_swing(rings[j], ring_region(spread[j], spread_i, abs(geometry[j, 3])))
            base = _base_cosine(one, two, off_ring, base_axes[j], own, lines_up)
            base_cosines[h, j] = base - (shift + aside) / shortest - rounding
            # The vector to a ring has the same component along the line as that to its centre, and is no longer than
            # the leg, its shift and the ring's radius together.
            least, most = _platform_cosine(one, two, start_i, end_i, own, cosines_up)
            loose = ((own.max() + shift + radius) * swing + shift) / shortest + rounding
            platform_cosines[h, j, 0], platform_cosines[h, j, 1] = least - loose, most + loose


@kernel
def sane(legs: Floats, start: Floats, end: Floats) -> bool:
    """Return whether there are poses, and lengths that are positive."""
    total = 0.0
    for r in range(6):
        total += start[r] + end[r]
    for j in range(5):
        for m in range(legs.shape[1]):
            if not legs[j, m] > 0.0:
                return False
    return bool(np.isfinite(total))


@kernel
def line_residuals(
    legs: Floats,
    start: Floats,
    end: Floats,
    first: Floats,
    second: Floats,
    rings: Floats | None,
    squares_up: Floats,
    products: Floats,
    residual: Floats,
) -> None:
    """Fill G along the line (6, 2k + 1): ½ (|D|² − l²) of each leg and ½ (|i|² − 1), as Bernstein coefficients.

    For a ring ½ r² − r ρ is added, with ρ interpolated by a quadratic polynomial from start, middle and end.
    """
    for j in range(5):
        _square(first[j], second[j], squares_up, residual[j])
        for a in range(len(products)):
            for b in range(len(products)):
                residual[j, a + b] -= 0.5 * products[a, b] * legs[j, a] * legs[j, b]
    _square(start[3:], end[3:], squares_up, residual[5])
    residual[5] -= 0.5
    if rings is not None:
        last = residual.shape[1] - 1
        for j in range(5):
            middle = 2.0 * rings[j, 2] - 0.5 * (rings[j, 0] + rings[j, 1])
            for m in range(last + 1):
                far = squares_up[0, m] * rings[j, 0] + squares_up[1, m] * middle + squares_up[2, m] * rings[j, 1]
                residual[j, m] += rings[j, 8] * (0.5 * rings[j, 8] - far)


@kernel
def _square(first: Floats, second: Floats, squares_up: Floats, out: Floats) -> None:
    """Fill the coefficients (2k + 1,) of ½ |v|², v on the straight line from first to second (3,)."""
    b0, b1, b2 = _dot(first, first), _dot(first, second), _dot(second, second)
    for m in range(len(out)):
        out[m] = 0.5 * (squares_up[0, m] * b0 + squares_up[1, m] * b1 + squares_up[2, m] * b2)


@kernel
def line_corrections(
    inverse: Floats, residual: Floats, size: float, rings: Floats | None, e: Floats, slack: Floats, y: Floats
) -> None:
    """Fill e = C G (6, 2k + 1), the error of it by rounding and curved ρ (6,), and bounds (6,) of both at all times."""
    rounding = ROUND * size * size
    for r in range(6):
        slack[r] = 4.0 * ROUND * abs(inverse[r, 5])
        for n in range(5):
            slack[r] += rounding * abs(inverse[r, n])
        if rings is not None:
            for n in range(5):
                slack[r] += RING_VALUE * rings[n, 8] * rings[n, 4] * abs(inverse[r, n])
        y[r] = 0.0
        for m in range(e.shape[1]):
            e[r, m] = 0.0
            for n in range(6):
                e[r, m] += inverse[r, n] * residual[n, m]
            y[r] = max(y[r], abs(e[r, m]))
        y[r] += slack[r]


@kernel
def _derivatives(
    e: Floats,
    slack: Floats,
    bound: Floats,
    inverse: Floats,
    defect: Floats,
    geometry: Floats,
    rings: Floats | None,
    change: Floats,
    step: Floats,
    spread: Floats,
    spread_i: Floats,
    de: Floats,
    off: Floats,
) -> bool:
    """Fill e' (6, 2k) and by how much (6,) the solution's derivative may differ from x̃' − e'; False where unbounded.

    J x' = (l l', 0) and C (J(x̃) x̃' − (l l', 0)) = e'. So f = x' − x̃' solves C J f = −e' − q with
    q = C (J(x) − J(x̃)) x̃', and |f + e'| ≤ |q| + |1 − C J| |f|.
    """
    size, degree = geometry[5, 2], de.shape[1]
    widened = 4.0 * degree  # what the rounding in slack adds to e'
    if rings is not None:
        widened = max(widened, RING_SLOPE / RING_VALUE)
    least, q, moved = np.empty(6), np.empty(6), np.zeros(6)
    for n in range(3):
        moved[5] += bound[3 + n] * (abs(step[3 + n]) + ROUND)
        for j in range(5):
            reach = bound[n] + abs(geometry[j, 3]) * bound[3 + n]
            moved[j] += reach * (abs(change[j, n]) + ROUND * size)
    if rings is not None:
        for j in range(5):
            if rings[j, 8] > 0.0:
                region, length = ring_region(spread[j], spread_i, abs(geometry[j, 3])), (norm(step[:3]), norm(step[3:]))
                moved[j] += rings[j, 8] * ring_bend(rings[j], region, (norm(bound[:3]), norm(bound[3:])), length)
    for r in range(6):
        q[r] = widened * slack[r]
        for j in range(6):
            q[r] += abs(inverse[r, j]) * moved[j]
        largest = 0.0
        for m in range(degree):
            de[r, m] = degree * (e[r, m + 1] - e[r, m])
            largest = max(largest, abs(de[r, m]))
        least[r] = largest + q[r]
    growth = inflated(least, size)
    contracted(inverse, defect, geometry, rings, spread, spread_i, growth, off)
    bounded = True
    for r in range(6):
        bounded = bounded and least[r] + off[r] < growth[r]
        off[r] += q[r]
    return bounded


@kernel
def _base_cosine(first: Floats, second: Floats, off: float, axis: Floats, legs: Floats, lines_up: Floats) -> float:
    """Return the least (v · axis − off) / l, v on the line from first to second (3,), l of coefficients (k + 1,).

    A quotient of polynomials lies between the quotients of their coefficients.
    """
    b0, b1 = _dot(first, axis) - off, _dot(second, axis) - off
    least = np.inf
    for m in range(len(legs)):
        least = min(least, (lines_up[0, m] * b0 + lines_up[1, m] * b1) / legs[m])
    return least


@kernel
def _platform_cosine(
    first: Floats, second: Floats, start_i: Floats, end_i: Floats, legs: Floats, cosines_up: Floats
) -> tuple[float, float]:
    """Return the least and the largest v · i / l, v and i on their lines; as `_base_cosine`."""
    b0, b2 = _dot(first, start_i), _dot(second, end_i)
    b1 = 0.5 * (_dot(first, end_i) + _dot(second, start_i))
    least, most = np.inf, -np.inf
    for m in range(cosines_up.shape[1]):
        length = 0.0
        for n in range(len(legs)):
            length += cosines_up[3 + n, m] * legs[n]
        value = (cosines_up[0, m] * b0 + cosines_up[1, m] * b1 + cosines_up[2, m] * b2) / length
        least, most = min(least, value), max(most, value)
    return least, most


@kernel
def _dot(a: Floats, b: Floats) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def _joined(bound: Floats, offset: float) -> float:
    """Return the largest |p + offset · i| of p and i that `bound` (6,) bounds."""
    x, y, z = bound[0] + offset * bound[3], bound[1] + offset * bound[4], bound[2] + offset * bound[5]
    return np.sqrt(x * x + y * y + z * z) * (1.0 + ROUND)


@kernel
def _farthest(e: Floats, step: Floats, moving: float, offset: float) -> float:
    """Return the largest |moving · step − e| of the point p + offset · i over the coefficients e (6, n)."""
    worst = 0.0
    for m in range(e.shape[1]):
        total = 0.0
        for n in range(3):
            part = moving * (step[n] + offset * step[3 + n]) - e[n, m] - offset * e[3 + n, m]
            total += part * part
        worst = max(worst, total)
    return np.sqrt(worst) * (1.0 + ROUND)
