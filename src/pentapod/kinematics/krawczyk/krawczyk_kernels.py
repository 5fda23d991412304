"""Krawczyk's operator for the leg equations around a straight line of poses, compiled; `chords_kernels` uses it.

G(x) = (½ (|p + z_j i − a_j|² − l_j²), ½ (|i|² − 1)) of x = (p, i), J its Jacobian, C ≈ J⁻¹ in the middle of the line.
Poses and boxes are arrays (6,), p in metres first. geometry (6, 4): for each leg the base joint (3) and the platform
offset; then δ, z_3 − δ x_3, a length that no sum of lengths exceeds, and 1 for a robot of the quadratic family, else 0.
rings (5, 9): see `ring_kernels`; None where no leg ends on a ring. numba compiles a variant for None without the
branches that ask for rings. Arrays are passed one by one: tuples of them cost a tenth of the time.

first, second, change (5, 3), step (6,): the legs' vectors at both ends of the line, their change, that of the pose.
inverse, defect (6, 6): C, and bounds of |1 − C J| in the middle. spread (5, 3), spread_i (3,): by how much the legs'
vectors and i may differ from those in the middle.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.krawczyk.ring_kernels import norm, ring_bend, ring_line
from pentapod.numerics.kernels import kernel

ROUND = 2.0**-46
"""Lemma 4 of docs/proofs.md: a result of fewer than 100 operations on products of size A has a smaller error than this
times A."""

RING_VALUE, RING_SLOPE = 0.00802, 0.5
"""Shares of max |ρ'''| by which the quadratic polynomial and its derivative may be off: lemma 15 of docs/proofs.md."""


@kernel
def fill_line(
    start: Floats,
    end: Floats,
    geometry: Floats,
    first: Floats,
    second: Floats,
    change: Floats,
    step: Floats,
    jacobian: Floats,
    rings: Floats | None,
) -> None:
    """Fill the line from start to end, the Jacobian (6, 6) in its middle, and rings: vectors lead to their centres."""
    for r in range(6):
        step[r] = end[r] - start[r]
    for j in range(5):
        offset = geometry[j, 3]
        for n in range(3):
            attached = geometry[j, n]
            first[j, n] = start[n] + offset * start[3 + n] - attached
            second[j, n] = end[n] + offset * end[3 + n] - attached
            change[j, n] = second[j, n] - first[j, n]
            jacobian[j, n] = 0.5 * (first[j, n] + second[j, n])
            jacobian[j, 3 + n] = offset * jacobian[j, n]
    for n in range(3):
        jacobian[5, 3 + n] = 0.5 * (start[3 + n] + end[3 + n])
    if rings is not None:
        for j in range(5):
            if rings[j, 8] > 0.0:
                ring_line(first[j], second[j], start, end, geometry[j, 3], jacobian[j], rings[j])


@kernel
def invert(matrix: Floats, work: Floats, inverse: Floats) -> bool:
    """Fill the inverse of matrix (6, 6) by elimination; False where it is singular. `defect` bounds its error."""
    work[:, :6], work[:, 6:] = matrix, 0.0
    for r in range(6):
        work[r, 6 + r] = 1.0
    for c in range(6):
        pivot = c
        for r in range(c + 1, 6):
            pivot = r if abs(work[r, c]) > abs(work[pivot, c]) else pivot
        if not abs(work[pivot, c]) > 0.0:
            return False
        for n in range(c, 12):
            work[c, n], work[pivot, n] = work[pivot, n], work[c, n]
        scale = 1.0 / work[c, c]
        for n in range(c, 12):
            work[c, n] *= scale
        for r in range(6):
            if r != c:
                factor = work[r, c]
                for n in range(c, 12):
                    work[r, n] -= factor * work[c, n]
    inverse[:] = work[:, 6:]
    return True


@kernel
def fill_defect(inverse: Floats, jacobian: Floats, defect: Floats) -> None:
    """Fill upper bounds of |1 − C J| in the middle."""
    for r in range(6):
        for c in range(6):
            total = 1.0 if r == c else 0.0
            large = total
            for n in range(6):
                total -= inverse[r, n] * jacobian[n, c]
                large += abs(inverse[r, n] * jacobian[n, c])
            defect[r, c] = abs(total) + ROUND * large


@kernel
def enclosed(
    y: Floats,
    inverse: Floats,
    defect: Floats,
    geometry: Floats,
    rings: Floats | None,
    change: Floats,
    step: Floats,
    spread: Floats,
    spread_i: Floats,
    z: Floats,
    bound: Floats,
) -> bool:
    """Return whether Krawczyk's operator maps a box around the line into itself.

    y (6,): bounds of |C G| on the line. Filled are z (6,), |1 − C J| times the box, and bound (6,), the solution's
    distance.
    """
    radius = inflated(y, geometry[5, 2])
    fill_spread(geometry, change, step, radius, spread, spread_i)
    contracted(inverse, defect, geometry, rings, spread, spread_i, radius, z)
    for r in range(6):
        bound[r] = y[r] + z[r]
        if not bound[r] < radius[r]:
            return False
    return True


@kernel
def inflated(bound: Floats, size: float) -> Floats:
    """Return a box (6,) that is larger than this one in every direction."""
    largest = 2.0**-50
    for r in range(6):
        largest = max(largest, bound[r] / (size if r < 3 else 1.0))
    radius = np.empty(6)
    for r in range(6):
        radius[r] = bound[r] + 0.5 * largest * (size if r < 3 else 1.0)
    return radius


@kernel
def fill_spread(
    geometry: Floats, change: Floats, step: Floats, radius: Floats, spread: Floats, spread_i: Floats
) -> None:
    """Fill by how much the legs' vectors and i may differ from those in the middle, in boxes of this radius."""
    rounding = ROUND * geometry[5, 2]
    for n in range(3):
        spread_i[n] = 0.5 * abs(step[3 + n]) + radius[3 + n] + ROUND
        for j in range(5):
            reach = radius[n] + abs(geometry[j, 3]) * radius[3 + n]
            spread[j, n] = 0.5 * abs(change[j, n]) + reach + rounding


@kernel
def contracted(
    inverse: Floats,
    defect: Floats,
    geometry: Floats,
    rings: Floats | None,
    spread: Floats,
    spread_i: Floats,
    v: Floats,
    out: Floats,
) -> None:
    """Fill an upper bound (6,) of |1 − C J| v for all Jacobians within the spread, v (6,) ≥ 0."""
    across_i = spread_i[0] * v[3] + spread_i[1] * v[4] + spread_i[2] * v[5]
    for r in range(6):
        out[r] = abs(inverse[r, 5]) * across_i
        for c in range(6):
            out[r] += defect[r, c] * v[c]
    for j in range(5):
        across, offset = 0.0, abs(geometry[j, 3])
        for n in range(3):
            across += spread[j, n] * (v[n] + offset * v[3 + n])
        for r in range(6):
            out[r] += abs(inverse[r, j]) * across
    if rings is not None:
        for j in range(5):
            if rings[j, 8] > 0.0:
                region = ring_region(spread[j], spread_i, abs(geometry[j, 3]))
                across = rings[j, 8] * ring_bend(rings[j], region, region, (norm(v[:3]), norm(v[3:])))
                for r in range(6):
                    out[r] += abs(inverse[r, j]) * across
    for r in range(6):
        out[r] *= 1.0 + ROUND


@kernel
def ring_region(spread: Floats, spread_i: Floats, offset: float) -> tuple[float, float]:
    """Return by how much d = p − a and i may differ from those in the middle, where the leg's vector and i do so."""
    turn = norm(spread_i)
    return norm(spread) + offset * turn, turn


@kernel
def angle_within(distance: float) -> float:
    """Return the largest angle, radians, between a unit vector and a vector whose tip is at most this far from its tip.

    Lemma 8 of docs/proofs.md: the sine is at most the distance, and from a distance of 1 on any angle is possible.
    """
    sine = distance * (1.0 + ROUND)
    return np.arcsin(sine) if sine < 1.0 else np.pi


@kernel
def sided(start: Floats, end: Floats, bound: Floats, signs: Floats, geometry: Floats) -> bool:
    """Return whether w and S have these signs all over the tube of this radius around the line.

    Outside the quadratic family there is no S, and w has the sign that it has at the start.
    """
    delta, lever, size, quadratic = geometry[5, 0], geometry[5, 1], geometry[5, 2], geometry[5, 3]
    if quadratic == 0.0:
        side = 1.0 if start[5] > 0.0 else -1.0
        return min(side * start[5], side * end[5]) - bound[5] > 4.0 * ROUND
    w = min(signs[0] * start[5], signs[0] * end[5]) - bound[5]
    # S = δ w p_x + (1 − δ u) p_z + lever · w is a quadratic along the line; its coefficients, and what the radius adds.
    s0 = delta * start[5] * start[0] + (1.0 - delta * start[3]) * start[2] + lever * start[5]
    s2 = delta * end[5] * end[0] + (1.0 - delta * end[3]) * end[2] + lever * end[5]
    s1 = 0.5 * delta * (start[5] * end[0] + end[5] * start[0] - start[3] * end[2] - end[3] * start[2])
    s1 += 0.5 * (start[2] + end[2]) + 0.5 * lever * (start[5] + end[5])
    s = min(signs[1] * s0, signs[1] * s1, signs[1] * s2)
    far_x, far_z = max(abs(start[0]), abs(end[0])), max(abs(start[2]), abs(end[2]))
    grown = abs(delta) * ((1.0 + bound[5]) * bound[0] + far_x * bound[5] + (1.0 + bound[3]) * bound[2])
    grown += abs(delta) * far_z * bound[3] + bound[2] + abs(lever) * bound[5]
    return w > 4.0 * ROUND and s - grown > 8.0 * ROUND * (1.0 + abs(delta)) * (size + far_x + far_z)


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
    b0, b1, b2 = (
        first[0] * first[0] + first[1] * first[1] + first[2] * first[2],
        first[0] * second[0] + first[1] * second[1] + first[2] * second[2],
        second[0] * second[0] + second[1] * second[1] + second[2] * second[2],
    )
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
