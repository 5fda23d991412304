"""Krawczyk's operator for many lines of poses at once, compiled: `krawczyk_kernels` with a lane for each line.

Arrays hold a number for each lane in their last axis, so that the innermost loops become vector instructions. Names and
shapes are those of `krawczyk_kernels`, with that axis behind; rings (LANES, 5, 9) come lane by lane. Each lane's result
is that of the same operations in the same order, whatever its neighbours are.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.krawczyk.krawczyk_kernels import RING_VALUE, ROUND, ring_region
from pentapod.kinematics.krawczyk.ring_kernels import norm, ring_bend, ring_line
from pentapod.numerics.kernels import kernel

LANES = 32
"""Lines at once: the loops over them take longer than what surrounds them, and the arrays stay in the cache."""


@kernel
def fill_lines(  # noqa: PLR0912 - short loops
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
    """Fill the lines from start to end, as `fill_line`; jacobian[5, :3] is 0."""
    for r in range(6):
        for t in range(LANES):
            step[r, t] = end[r, t] - start[r, t]
    for j in range(5):
        offset = geometry[j, 3]
        for n in range(3):
            attached = geometry[j, n]
            for t in range(LANES):
                first[j, n, t] = start[n, t] + offset * start[3 + n, t] - attached
            for t in range(LANES):
                second[j, n, t] = end[n, t] + offset * end[3 + n, t] - attached
            for t in range(LANES):
                change[j, n, t] = second[j, n, t] - first[j, n, t]
            for t in range(LANES):
                jacobian[j, n, t] = 0.5 * (first[j, n, t] + second[j, n, t])
            for t in range(LANES):
                jacobian[j, 3 + n, t] = offset * jacobian[j, n, t]
    for n in range(3):
        for t in range(LANES):
            jacobian[5, 3 + n, t] = 0.5 * (start[3 + n, t] + end[3 + n, t])
    if rings is not None:
        for t in range(LANES):
            for j in range(5):
                if rings[t, j, 8] > 0.0:
                    ring_line(
                        first[j, :, t],
                        second[j, :, t],
                        start[:, t],
                        end[:, t],
                        geometry[j, 3],
                        jacobian[j, :, t],
                        rings[t, j],
                    )


@kernel
def invert(matrix: Floats, work: Floats, inverse: Floats) -> None:  # noqa: PLR0912 - short loops
    """Fill the inverses of matrices (6, 6, LANES) by elimination; infinite or NaN where one is singular.

    In place: column c of work becomes that of the inverse whose row was exchanged for row c.
    """
    rows, largest = np.empty((6, LANES), dtype=np.int64), np.empty(LANES)
    work[:] = matrix
    for c in range(6):
        for t in range(LANES):
            largest[t] = abs(work[c, c, t])
        for t in range(LANES):
            rows[c, t] = c
        for r in range(c + 1, 6):
            for t in range(LANES):
                rows[c, t] = r if abs(work[r, c, t]) > largest[t] else rows[c, t]
            for t in range(LANES):
                largest[t] = max(largest[t], abs(work[r, c, t]))
        for t in range(LANES):
            pivot = rows[c, t]
            if pivot != c:
                for n in range(6):
                    work[c, n, t], work[pivot, n, t] = work[pivot, n, t], work[c, n, t]
        for t in range(LANES):
            work[c, c, t] = 1.0 / work[c, c, t]
        for n in range(6):
            if n != c:
                for t in range(LANES):
                    work[c, n, t] *= work[c, c, t]
        for r in range(6):
            if r != c:
                for n in range(6):
                    if n != c:
                        for t in range(LANES):
                            work[r, n, t] -= work[r, c, t] * work[c, n, t]
                for t in range(LANES):
                    work[r, c, t] = -work[r, c, t] * work[c, c, t]
    for t in range(LANES):
        for back in range(6):
            c = 5 - back
            pivot = rows[c, t]
            if pivot != c:
                for r in range(6):
                    work[r, c, t], work[r, pivot, t] = work[r, pivot, t], work[r, c, t]
    inverse[:] = work


@kernel
def fill_defects(inverse: Floats, jacobian: Floats, defect: Floats) -> None:
    """Fill upper bounds of |1 − C J| in the middle."""
    for r in range(6):
        for c in range(6):
            one = 1.0 if r == c else 0.0
            for t in range(LANES):
                a = inverse[r, 0, t] * jacobian[0, c, t]
                total, large = one - a, one + abs(a)
                for n in range(1, 6):
                    a = inverse[r, n, t] * jacobian[n, c, t]
                    total -= a
                    large += abs(a)
                defect[r, c, t] = abs(total) + ROUND * large


@kernel
def inflate(bound: Floats, size: float, radius: Floats) -> None:
    """Fill boxes (6, LANES) that are larger than these in every direction."""
    for t in range(LANES):
        largest = 2.0**-50
        for r in range(6):
            largest = max(largest, bound[r, t] / (size if r < 3 else 1.0))
        for r in range(6):
            radius[r, t] = bound[r, t] + 0.5 * largest * (size if r < 3 else 1.0)


@kernel
def fill_spreads(
    geometry: Floats, change: Floats, step: Floats, radius: Floats, spread: Floats, spread_i: Floats
) -> None:
    """Fill by how much the legs' vectors and i may differ from those in the middle, in boxes of this radius."""
    rounding = ROUND * geometry[5, 2]
    for n in range(3):
        for t in range(LANES):
            spread_i[n, t] = 0.5 * abs(step[3 + n, t]) + radius[3 + n, t] + ROUND
        for j in range(5):
            offset = abs(geometry[j, 3])
            for t in range(LANES):
                reach = radius[n, t] + offset * radius[3 + n, t]
                spread[j, n, t] = 0.5 * abs(change[j, n, t]) + reach + rounding


@kernel
def contract(  # noqa: PLR0912 - short loops
    inverse: Floats,
    defect: Floats,
    geometry: Floats,
    rings: Floats | None,
    spread: Floats,
    spread_i: Floats,
    v: Floats,
    across: Floats,
    out: Floats,
) -> None:
    """Fill upper bounds (6, LANES) of |1 − C J| v for all Jacobians within the spread, v (6, LANES) ≥ 0.

    across (6, LANES): room.
    """
    for t in range(LANES):
        across[5, t] = spread_i[0, t] * v[3, t] + spread_i[1, t] * v[4, t] + spread_i[2, t] * v[5, t]
    for j in range(5):
        offset = abs(geometry[j, 3])
        for t in range(LANES):
            total = spread[j, 0, t] * (v[0, t] + offset * v[3, t])
            total += spread[j, 1, t] * (v[1, t] + offset * v[4, t])
            across[j, t] = total + spread[j, 2, t] * (v[2, t] + offset * v[5, t])
    for r in range(6):
        for t in range(LANES):
            total = abs(inverse[r, 5, t]) * across[5, t]
            for c in range(6):
                total += defect[r, c, t] * v[c, t]
            for j in range(5):
                total += abs(inverse[r, j, t]) * across[j, t]
            out[r, t] = total
    if rings is not None:
        for t in range(LANES):
            for j in range(5):
                if rings[t, j, 8] > 0.0:
                    region = ring_region(spread[j, :, t], spread_i[:, t], abs(geometry[j, 3]))
                    bent = rings[t, j, 8] * ring_bend(rings[t, j], region, region, (norm(v[:3, t]), norm(v[3:, t])))
                    for r in range(6):
                        out[r, t] += abs(inverse[r, j, t]) * bent
    for r in range(6):
        for t in range(LANES):
            out[r, t] *= 1.0 + ROUND


@kernel
def residuals(
    legs: Floats,
    start: Floats,
    end: Floats,
    first: Floats,
    second: Floats,
    rings: Floats | None,
    squares_up: Floats,
    products: Floats,
    room: Floats,
    residual: Floats,
) -> None:
    """Fill G along the lines (6, 2k + 1, LANES), as `line_residuals`. room (3, LANES)."""
    for j in range(5):
        squares(first[j], second[j], squares_up, room, residual[j])
        for a in range(len(products)):
            for b in range(len(products)):
                factor = 0.5 * products[a, b]
                for t in range(LANES):
                    residual[j, a + b, t] -= factor * legs[j, a, t] * legs[j, b, t]
    squares(start[3:], end[3:], squares_up, room, residual[5])
    for m in range(residual.shape[1]):
        for t in range(LANES):
            residual[5, m, t] -= 0.5
    if rings is not None:
        for t in range(LANES):
            for j in range(5):
                ring = rings[t, j]
                middle = 2.0 * ring[2] - 0.5 * (ring[0] + ring[1])
                for m in range(residual.shape[1]):
                    far = squares_up[0, m] * ring[0] + squares_up[1, m] * middle + squares_up[2, m] * ring[1]
                    residual[j, m, t] += ring[8] * (0.5 * ring[8] - far)


@kernel
def squares(first: Floats, second: Floats, squares_up: Floats, room: Floats, out: Floats) -> None:
    """Fill the coefficients (2k + 1, LANES) of ½ |v|², v on the straight lines from first to second (3, LANES).

    room (3, LANES).
    """
    for t in range(LANES):
        room[0, t] = first[0, t] * first[0, t] + first[1, t] * first[1, t] + first[2, t] * first[2, t]
    for t in range(LANES):
        room[1, t] = first[0, t] * second[0, t] + first[1, t] * second[1, t] + first[2, t] * second[2, t]
    for t in range(LANES):
        room[2, t] = second[0, t] * second[0, t] + second[1, t] * second[1, t] + second[2, t] * second[2, t]
    for m in range(len(out)):
        s0, s1, s2 = squares_up[0, m], squares_up[1, m], squares_up[2, m]
        for t in range(LANES):
            out[m, t] = 0.5 * (s0 * room[0, t] + s1 * room[1, t] + s2 * room[2, t])


@kernel
def corrections(  # noqa: PLR0912 - short loops
    inverse: Floats, residual: Floats, size: float, rings: Floats | None, e: Floats, slack: Floats, y: Floats
) -> None:
    """Fill e = C G (6, 2k + 1, LANES), its error (6, LANES), and bounds (6, LANES) of both: see `line_corrections`."""
    rounding = ROUND * size * size
    for r in range(6):
        for t in range(LANES):
            total = 4.0 * ROUND * abs(inverse[r, 5, t])
            for n in range(5):
                total += rounding * abs(inverse[r, n, t])
            slack[r, t] = total
        if rings is not None:
            for t in range(LANES):
                for n in range(5):
                    slack[r, t] += RING_VALUE * rings[t, n, 8] * rings[t, n, 4] * abs(inverse[r, n, t])
        for m in range(e.shape[1]):
            for t in range(LANES):
                total = inverse[r, 0, t] * residual[0, m, t]
                for n in range(1, 6):
                    total += inverse[r, n, t] * residual[n, m, t]
                e[r, m, t] = total
        for t in range(LANES):
            y[r, t] = abs(e[r, 0, t])
        for m in range(1, e.shape[1]):
            for t in range(LANES):
                y[r, t] = max(y[r, t], abs(e[r, m, t]))
        for t in range(LANES):
            y[r, t] += slack[r, t]
