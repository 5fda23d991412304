"""Poses of a machine as built, found and proven one after the other, compiled (lemma 16 of docs/proofs.md).

Arrays as in `krawczyk_kernels`: poses (6,), geometry (6, 4) with the nominal machine's δ and z_3 − δ x_3 in its last
row, rings (5, 9) or None. A *stage* is the geometry at one moment between the nominal and the real one.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.kinematics.proofs.krawczyk_kernels import ROUND, enclosed, fill_defect, fill_line, invert, sided
from pentapod.kinematics.proofs.ring_kernels import NEAREST
from pentapod.numerics.kernels import kernel

TURNS, SETTLED, NEIGHBOUR = 12, 1e-6, 5e-3
"""Newton's steps at most; size of a step (metres, radians) after which one more with the same Jacobian ends them; how
far the nominal pose of a neighbour may be."""


@kernel
def built_poses(
    lengths: Floats,
    poses: Floats,
    stages: Floats,
    ring_stages: Floats,
    shift: Floats,
    signs: Floats,
    order: Floats,
    weight: float,
    proven: Bools,
) -> None:
    """Move poses (N, 6) to where the legs have these lengths (N, 5), and prove that they are in their branch.

    stages (M, 6, 4), ring_stages (M, 5, 9): the real geometry, then those in the middle of the whole way, of its halves
    and of its quarters, then the nominal one. shift (5, 5): by how much a, z and r of each leg change on the whole way.
    signs (N, 2): the nominal component; order (N,): the sign of the Jacobian's determinant, 0 for
    a nominal machine of the quadratic family. weight: metres that count as much as a radian.
    """
    first, second, change, step = np.empty((5, 3)), np.empty((5, 3)), np.empty((5, 3)), np.empty(6)
    jacobian, inverse, work, defect = np.zeros((6, 6)), np.empty((6, 6)), np.empty((6, 12)), np.empty((6, 6))
    spread, spread_i, g = np.empty((5, 3)), np.empty(3), np.empty(6)
    y, z, bound = np.empty(6), np.empty(6), np.empty(6)
    geometry, rings = stages[0], ring_stages[0]
    nominal, last = np.empty(6), np.empty(6)
    for h in range(len(lengths)):
        x = poses[h]
        known = h > 0 and proven[h - 1] and np.abs(x - last).max() < NEIGHBOUR
        nominal[:] = x
        proven[h] = False
        if not np.isfinite(x[0] + x[3] + lengths[h].sum()):
            continue
        if known:  # from the nominal pose to the real one it is about as far as for the pose before
            for r in range(6):
                x[r] += poses[h - 1, r] - last[r]
        last[:] = nominal
        if not solved(x, lengths[h], geometry, rings, first, second, change, step, jacobian, work, inverse, g):
            x[:] = np.nan
            continue
        fill_line(x, x, geometry, first, second, change, step, jacobian, rings)
        fill_defect(inverse, jacobian, defect)
        equations(x, lengths[h], first, rings, g)
        rounding = ROUND * geometry[5, 2] * geometry[5, 2]
        for r in range(6):
            total = inverse[r, 5] * g[5]
            y[r] = 4.0 * ROUND * abs(inverse[r, 5])
            for n in range(5):
                total += inverse[r, n] * g[n]
                y[r] += rounding * abs(inverse[r, n])
            y[r] += abs(total)
        if not enclosed(y, inverse, defect, geometry, rings, change, step, spread, spread_i, z, bound):
            continue
        if order[h] == 0.0 and not sided(x, x, bound, signs[h], stages[-1]):
            continue
        if not _joined(x, bound, stages, ring_stages, shift, weight, first, second, change, step, jacobian, work,
                       inverse, defect):  # fmt: skip
            continue
        proven[h] = True
        if order[h] != 0.0:  # the determinant does not vanish near x
            fill_line(x, x, stages[-1], first, second, change, step, jacobian, ring_stages[-1])
            image = signs[h, 1] * x[5] - bound[5] > 4.0 * ROUND
            proven[h] = image and _determinant_sign(jacobian, work) == order[h]


@kernel
def solved(
    x: Floats,
    lengths: Floats,
    geometry: Floats,
    rings: Floats,
    first: Floats,
    second: Floats,
    change: Floats,
    step: Floats,
    jacobian: Floats,
    work: Floats,
    inverse: Floats,
    g: Floats,
) -> bool:
    """Move a pose to a solution by Newton's method, and fill C from its last step; return whether it converged."""
    for _ in range(TURNS):
        fill_line(x, x, geometry, first, second, change, step, jacobian, rings)
        if not invert(jacobian, work, inverse):
            return False
        equations(x, lengths, first, rings, g)
        if _newton_step(inverse, g, x) < SETTLED:
            fill_line(x, x, geometry, first, second, change, step, jacobian, rings)
            equations(x, lengths, first, rings, g)
            _newton_step(inverse, g, x)
            return True
    return False


@kernel
def equations(x: Floats, lengths: Floats, vectors: Floats, rings: Floats, g: Floats) -> None:
    """Fill G (6,) at a pose whose leg vectors and ring distances `fill_line` has filled."""
    for j in range(5):
        r = rings[j, 8]
        square = vectors[j, 0] ** 2 + vectors[j, 1] ** 2 + vectors[j, 2] ** 2
        g[j] = 0.5 * (square - lengths[j] ** 2)
        if r > 0.0:
            g[j] += r * (0.5 * r - rings[j, 0])
    g[5] = 0.5 * (x[3] ** 2 + x[4] ** 2 + x[5] ** 2 - 1.0)


@kernel
def _newton_step(inverse: Floats, g: Floats, x: Floats) -> float:
    """Subtract C G from the pose; return the largest change."""
    largest = 0.0
    for r in range(6):
        total = 0.0
        for n in range(6):
            total += inverse[r, n] * g[n]
        x[r] -= total
        largest = max(largest, abs(total))
    return largest


@kernel
def _determinant_sign(matrix: Floats, work: Floats) -> float:
    """Return the sign of the determinant of a matrix (6, 6) that is far from singular."""
    work[:, :6] = matrix
    sign = 1.0
    for c in range(6):
        pivot = c
        for r in range(c + 1, 6):
            pivot = r if abs(work[r, c]) > abs(work[pivot, c]) else pivot
        if pivot != c:
            sign = -sign
            for n in range(c, 6):
                work[c, n], work[pivot, n] = work[pivot, n], work[c, n]
        if work[c, c] < 0.0:
            sign = -sign
        for r in range(c + 1, 6):
            factor = work[r, c] / work[c, c]
            for n in range(c, 6):
                work[r, n] -= factor * work[c, n]
    return sign


@kernel
def _joined(
    x: Floats,
    bound: Floats,
    stages: Floats,
    ring_stages: Floats,
    shift: Floats,
    weight: float,
    first: Floats,
    second: Floats,
    change: Floats,
    step: Floats,
    jacobian: Floats,
    work: Floats,
    inverse: Floats,
    defect: Floats,
) -> bool:
    """Return whether the Jacobian stays regular while the pose stays and the geometry goes from nominal to real.

    Tried are the whole way from its end, where the Jacobian is known, then from its middle, its halves, its quarters.
    """
    for r in range(3):
        if not bound[r] < 1e-7 or not bound[3 + r] < 1e-7:
            return False
    if _regular(x, first, stages[0], ring_stages[0], shift, 1.0, weight, jacobian, inverse, defect):
        return True
    at, pieces = 1, 1
    while at + pieces < len(stages):
        good = True
        for n in range(pieces):
            fill_line(x, x, stages[at + n], first, second, change, step, jacobian, ring_stages[at + n])
            good = good and invert(jacobian, work, inverse)
            if not good:
                break
            fill_defect(inverse, jacobian, defect)
            good = _regular(
                x, first, stages[at + n], ring_stages[at + n], shift, 0.5 / pieces, weight, jacobian, inverse, defect
            )
            if not good:
                break
        if good:
            return True
        at += pieces
        pieces *= 2
    return False


@kernel
def _regular(
    x: Floats,
    vectors: Floats,
    geometry: Floats,
    rings: Floats,
    shift: Floats,
    half: float,
    weight: float,
    jacobian: Floats,
    inverse: Floats,
    defect: Floats,
) -> bool:
    """Return whether ‖1 − C J‖ < 1 for all geometries within this share of the shift, and all poses within 1e-7.

    Norm: the largest component, positions divided by `weight`.
    """
    near = 1e-6  # what the pose's distance may add to a row of J, and to ρ, by far
    change, rest = np.empty((5, 6)), np.empty(5)
    for j in range(5):
        z, dz, r_m, dr = geometry[j, 3], half * shift[j, 3], rings[j, 8], half * shift[j, 4]
        da = np.sqrt(shift[j, 0] ** 2 + shift[j, 1] ** 2 + shift[j, 2] ** 2) * half
        swing, turn = 0.0, 0.0
        if r_m > 0.0:
            far, unit = rings[j, 3] + da, 1.001
            if not rings[j, 2] - da * unit - near > NEAREST * far:
                return False
            swing = 2.0 * (da * unit + near) / rings[j, 2]
            turn = swing * far + da + near
        reach = abs(dz) + da
        rest[j] = 3.0 * weight * (near + (abs(dr) + r_m) * swing)
        rest[j] += 3.0 * ((abs(z) + abs(dz)) * near + abs(dz) * reach + (abs(dr) + r_m) * turn)
        for c in range(3):
            e, de = vectors[j, c], half * (shift[j, 3] * x[3 + c] - shift[j, c])
            change[j, c], change[j, 3 + c] = de, z * de + dz * e
            if r_m > 0.0:
                change[j, c] -= dr * (e - jacobian[j, c]) / r_m
                change[j, 3 + c] -= dr * (z * e - jacobian[j, 3 + c]) / r_m
    for r in range(6):
        total = 3.0 * near * abs(inverse[r, 5])
        for j in range(5):
            total += abs(inverse[r, j]) * rest[j]
        for c in range(6):
            moved = 0.0
            for j in range(5):
                moved += inverse[r, j] * change[j, c]
            total += (abs(moved) + defect[r, c]) * (weight if c < 3 else 1.0)
        if not total * (1.0 + 1e-9) < (weight if r < 3 else 1.0):
            return False
    return True
