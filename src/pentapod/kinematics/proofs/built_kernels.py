"""Poses of a machine as built, found and proven one after the other, compiled (lemma 16 of docs/proofs.md).

Arrays as in `krawczyk_kernels`: poses (6,), geometry (6, 4) with the nominal machine's δ and z_3 − δ x_3 in its last
row, rings (5, 9) or None. A *stage* is the geometry at one moment between the nominal and the real one.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.kinematics.krawczyk.krawczyk_kernels import ROUND, enclosed, fill_defect, fill_line, invert, sided
from pentapod.kinematics.krawczyk.ring_kernels import NEAREST
from pentapod.kinematics.proofs.newton_kernels import equations, solved
from pentapod.numerics.kernels import kernel

NEIGHBOUR = 5e-3
"""How far (metres, radians) the nominal pose of a neighbour may be."""

NARROWEST, WIDEST, HELD = 2e-4, 4e-3, 1e-7
"""Radius (metres, radians) of the region of poses for which the way between the geometries is proven at once, so that
the rows after a pose share its proof; how far the exact pose may be from the one that was found."""


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
    nominal, last, region = np.empty(6), np.empty(6), np.empty(8)
    region[0], region[6], region[7] = np.inf, 0.0, WIDEST
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
        if not bound.max() < HELD:
            continue
        if not held(x, known, region, stages, ring_stages, shift, weight, first, second, change, step, jacobian, work,
                     inverse, defect):  # fmt: skip
            continue
        proven[h] = True
        if order[h] != 0.0:  # the determinant does not vanish near x
            fill_line(x, x, stages[-1], first, second, change, step, jacobian, ring_stages[-1])
            image = signs[h, 1] * x[5] - bound[5] > 4.0 * ROUND
            proven[h] = image and _determinant_sign(jacobian, work) == order[h]


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
def held(
    x: Floats,
    known: bool,
    region: Floats,
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
    """Return `_joined` of a pose, from the region of an earlier one where it is in it.

    region (8,): its middle, how far it reaches, and how far the next one is to reach. known: whether poses follow one
    another: only then a region is looked for. The arrays hold the line of this pose, C and its defect.
    """
    moved, turned = 0.0, 0.0
    for n in range(3):
        moved += (x[n] - region[n]) ** 2
        turned += (x[3 + n] - region[3 + n]) ** 2
    if max(moved, turned) <= region[6] ** 2:
        return True
    region[0] = np.inf  # nothing is proven yet
    if known:
        region[6] = region[7]
        if _joined(x, region[6], stages, ring_stages, shift, weight, first, second, change, step, jacobian, work,
                   inverse, defect):  # fmt: skip
            region[:6], region[7] = x, min(2.0 * region[7], WIDEST)
            return True
        region[7] = max(0.25 * region[7], NARROWEST)
        fill_line(x, x, stages[0], first, second, change, step, jacobian, ring_stages[0])
        if not invert(jacobian, work, inverse):
            return False
        fill_defect(inverse, jacobian, defect)
    region[6] = 0.0
    good = _joined(x, 0.0, stages, ring_stages, shift, weight, first, second, change, step, jacobian, work, inverse,
                   defect)  # fmt: skip
    if good:
        region[:6] = x
    return good


@kernel
def _joined(
    x: Floats,
    reach: float,
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
    """Return whether the Jacobian stays regular while a pose stays and the geometry goes from nominal to real.

    So for all poses within reach of this one. Tried are the whole way from its end, where the Jacobian is known, then
    from its middle, its halves, its quarters.
    """
    if _regular(x, reach, first, stages[0], ring_stages[0], shift, 1.0, weight, jacobian, inverse, defect):
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
            good = _regular(x, reach, first, stages[at + n], ring_stages[at + n], shift, 0.5 / pieces, weight, jacobian,
                            inverse, defect)  # fmt: skip
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
    reach: float,
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
    """Return whether ‖1 − C J‖ < 1 for all geometries within this share of the shift, and all poses within reach.

    Norm: the largest component, positions divided by `weight`.
    """
    near = 1e-6  # what the exact pose's distance from the one found may add to a row of J, and to ρ, by far
    change, rest = np.empty((5, 6)), np.empty(5)
    for j in range(5):
        z, dz, r_m, dr = geometry[j, 3], half * shift[j, 3], rings[j, 8], half * shift[j, 4]
        da = np.sqrt(shift[j, 0] ** 2 + shift[j, 1] ** 2 + shift[j, 2] ** 2) * half
        off = near + (1.0 + abs(z) + abs(dz)) * reach
        swing, turn = 0.0, 0.0
        if r_m > 0.0:
            far, unit = rings[j, 3] + da + reach, 1.001
            across = near + (da + reach) * unit + far * reach
            if not rings[j, 2] - across > NEAREST * far:
                return False
            swing = 2.0 * across / rings[j, 2]
            turn = swing * far + da + reach + near
        ring = abs(dr) + r_m
        rest[j] = 3.0 * weight * (off + ring * (swing + reach))
        rest[j] += 3.0 * ((abs(z) + abs(dz)) * off + abs(dz) * (abs(dz) + da) + ring * turn)
        for c in range(3):
            e, de = vectors[j, c], half * (shift[j, 3] * x[3 + c] - shift[j, c])
            change[j, c], change[j, 3 + c] = de, z * de + dz * e
            if r_m > 0.0:
                change[j, c] -= dr * (e - jacobian[j, c]) / r_m
                change[j, 3 + c] -= dr * (z * e - jacobian[j, 3 + c]) / r_m
    for r in range(6):
        total = 3.0 * (near + reach) * abs(inverse[r, 5])
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
