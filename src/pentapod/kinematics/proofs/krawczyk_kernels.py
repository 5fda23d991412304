"""Krawczyk's operator on the leg equations, beside a straight line of poses: pieces of `chords_kernels`, compiled.

G(x) = (½ (|p + z_j i − a_j|² − l_j²), ½ (|i|² − 1)) of x = (p, i), J its Jacobian, C ≈ J⁻¹ in the middle of the line.
Legs may end on rings (`ring_kernels`). Poses and boxes are (6,), p in metres first. geometry (6, 5): base joints (3),
offset and radius of the ring of each leg; then δ, the lever, a length that no sum of lengths exceeds, 1 where the
machine is of the quadratic family, 0 where it is not, and the largest radius.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.proofs.ring_kernels import ring_bend, ring_line
from pentapod.numerics.kernels import kernel

ROUND = 2.0**-46
"""Lemma 4 of docs/proofs.md: a result of fewer than 100 operations on products of size A is off by less than this
times A."""


@kernel
def line(
    start: Floats,
    end: Floats,
    geometry: Floats,
    first: Floats,
    second: Floats,
    change: Floats,
    step: Floats,
    jacobian: Floats,
    rings: Floats,
) -> None:
    """Fill the vectors of the legs at both ends and their change (5, 3), the poses' (6,), the middle's Jacobian.

    rings (5, 8): filled for legs that end on rings, by `ring_line`; their vectors lead to the rings' centres.
    """
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
    if geometry[5, 4] > 0.0:
        for j in range(5):
            if geometry[j, 4] > 0.0:
                ring_line(first[j], second[j], start, end, geometry[j, 3], geometry[j, 4], jacobian[j], rings[j])


@kernel
def invert(matrix: Floats, work: Floats, inverse: Floats) -> bool:
    """Fill the inverse of matrix (6, 6) by elimination; False where there is none. What it is worth, `rest` tells."""
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
def defect(inverse: Floats, jacobian: Floats, rest: Floats) -> None:
    """Fill upper bounds (6, 6) of |1 − C J| in the middle."""
    for r in range(6):
        for c in range(6):
            total = 1.0 if r == c else 0.0
            large = total
            for n in range(6):
                total -= inverse[r, n] * jacobian[n, c]
                large += abs(inverse[r, n] * jacobian[n, c])
            rest[r, c] = abs(total) + ROUND * large


@kernel
def enclosed(
    y: Floats,
    rest: Floats,
    inverse: Floats,
    geometry: Floats,
    rings: Floats,
    change: Floats,
    step: Floats,
    spread: Floats,
    spread_i: Floats,
    z: Floats,
    bound: Floats,
) -> bool:
    """Return whether Krawczyk's operator maps a box around the line into itself; bound (6,): its distance."""
    radius = inflated(y, geometry[5, 2])
    spreads(geometry, change, step, radius, ROUND * geometry[5, 2], spread, spread_i)
    mapped(rest, inverse, geometry, rings, spread, spread_i, radius, z)
    for r in range(6):
        bound[r] = y[r] + z[r]
        if not bound[r] < radius[r]:
            return False
    return True


@kernel
def inflated(bound: Floats, size: float) -> Floats:
    """Return a box (6,) larger than this one, in every direction."""
    largest = 2.0**-50
    for r in range(6):
        largest = max(largest, bound[r] / (size if r < 3 else 1.0))
    radius = np.empty(6)
    for r in range(6):
        radius[r] = bound[r] + 0.5 * largest * (size if r < 3 else 1.0)
    return radius


@kernel
def spreads(
    geometry: Floats, change: Floats, step: Floats, radius: Floats, rounding: float, spread: Floats, spread_i: Floats
) -> None:
    """Fill how far each leg's vector (5, 3) and i (3,) may be from those in the middle, within the radius."""
    for n in range(3):
        spread_i[n] = 0.5 * abs(step[3 + n]) + radius[3 + n] + ROUND
        for j in range(5):
            reach = radius[n] + abs(geometry[j, 3]) * radius[3 + n]
            spread[j, n] = 0.5 * abs(change[j, n]) + reach + rounding


@kernel
def mapped(
    rest: Floats,
    inverse: Floats,
    geometry: Floats,
    rings: Floats,
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
            out[r] += rest[r, c] * v[c]
    for j in range(5):
        across, offset = 0.0, abs(geometry[j, 3])
        for n in range(3):
            across += spread[j, n] * (v[n] + offset * v[3 + n])
        for r in range(6):
            out[r] += abs(inverse[r, j]) * across
    if geometry[5, 4] > 0.0:
        _add_rings(inverse, geometry, rings, spread, spread_i, v, out)
    for r in range(6):
        out[r] *= 1.0 + ROUND


@kernel
def _add_rings(
    inverse: Floats, geometry: Floats, rings: Floats, spread: Floats, spread_i: Floats, v: Floats, out: Floats
) -> None:
    """Add to `mapped` what the bend of ρ makes of v."""
    for j in range(5):
        if geometry[j, 4] > 0.0:
            region = about(spread[j], spread_i, abs(geometry[j, 3]))
            across = geometry[j, 4] * ring_bend(rings[j], region, region, (norm(v[:3]), norm(v[3:])))
            for r in range(6):
                out[r] += abs(inverse[r, j]) * across


@kernel
def about(spread: Floats, spread_i: Floats, offset: float) -> tuple[float, float]:
    """Return by how much d = p − a and i differ from those in the middle, at most, where leg's vector and i do so."""
    turn = norm(spread_i)
    return norm(spread) + offset * turn, turn


@kernel
def norm(a: Floats) -> float:
    """Return the length of a vector (3,)."""
    return np.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@kernel
def angle_within(distance: float) -> float:
    """Return the largest angle, radians, between a unit vector and one whose tip is no farther from its tip than this.

    Lemma 8 of docs/proofs.md: the sine is at most the distance, and from a distance of 1 on any angle is possible.
    """
    sine = distance * (1.0 + ROUND)
    return np.arcsin(sine) if sine < 1.0 else np.pi


@kernel
def sided(
    start: Floats, end: Floats, bound: Floats, delta: float, lever: float, signs: Floats, size: float, quadratic: float
) -> bool:
    """Return whether w and S have these signs all over the tube of this radius around the line.

    Outside the quadratic family there is no S, and w has the sign that it has at the start.
    """
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
