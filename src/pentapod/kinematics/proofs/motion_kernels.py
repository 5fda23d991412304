"""Krawczyk's test on every interval of a program at once, compiled: what `motion` proves, for short intervals.

Arrays as in `krawczyk_kernels` and `chords_kernels`. The boxes are multiples of one shape, so that those of neighbours
contain one another at the pose between them (lemma 10 of docs/proofs.md).
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.kinematics.proofs.chords_kernels import line_corrections, line_residuals, sane
from pentapod.kinematics.proofs.krawczyk_kernels import (
    ROUND,
    contracted,
    fill_defect,
    fill_line,
    fill_spread,
    invert,
)
from pentapod.numerics.kernels import kernel


@kernel
def motions(
    legs: Floats,
    poses: Floats,
    geometry: Floats,
    rings: Floats | None,
    leg_error: float,
    weight: float,
    bases: tuple[Floats, Floats, Floats, Floats],
    proven: Bools,
    sensitivity: Floats,
) -> None:
    """Fill which of N intervals are proven (N,), and how far legs that are off by a metre move p at most (N,).

    legs (N, 5, k + 1): lengths; poses (N + 1, 6); leg_error: by which each length may differ, metres; weight: metres
    that count as much as a radian; bases: as for `chords`.
    """
    products, squares_up = bases[0], bases[1]
    k = legs.shape[2] - 1
    first, second, change, step = np.empty((5, 3)), np.empty((5, 3)), np.empty((5, 3)), np.empty(6)
    jacobian, inverse, work, defect = np.zeros((6, 6)), np.empty((6, 6)), np.empty((6, 12)), np.empty((6, 6))
    spread, spread_i = np.empty((5, 3)), np.empty(3)
    residual, e = np.empty((6, 2 * k + 1)), np.empty((6, 2 * k + 1))
    slack, y, z, radius = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    for h in range(len(legs)):
        proven[h], sensitivity[h] = False, np.inf
        start, end = poses[h], poses[h + 1]
        if not sane(legs[h], start, end):
            continue
        fill_line(start, end, geometry, first, second, change, step, jacobian, rings)
        if not invert(jacobian, work, inverse):
            continue
        fill_defect(inverse, jacobian, defect)
        line_residuals(legs[h], start, end, first, second, rings, squares_up, products, residual)
        line_corrections(inverse, residual, geometry[5, 2], rings, e, slack, y)
        largest = 2.0**-50
        for r in range(6):
            for j in range(5):  # ½ (l + error)² − ½ l², and more
                y[r] += abs(inverse[r, j]) * (legs[h, j].max() + leg_error) * leg_error * (1.0 + ROUND)
            largest = max(largest, y[r] / (weight if r < 3 else 1.0))
        for r in range(6):
            radius[r] = 2.0 * largest * (weight if r < 3 else 1.0)
        fill_spread(geometry, change, step, radius, spread, spread_i)
        contracted(inverse, defect, geometry, rings, spread, spread_i, radius, z)
        share, kept = 0.0, True
        for r in range(6):
            kept = kept and y[r] + z[r] < radius[r]
            share = max(share, z[r] / radius[r])
        if not kept or not share < 1.0:
            continue
        proven[h] = True
        # (1 − E)⁻¹ C l = C l + E (1 − E)⁻¹ C l, ‖E‖ ≤ share, as in `tube.sensitivity`.
        most, most_p = 0.0, 0.0
        for r in range(6):
            moved = 0.0
            for j in range(5):
                moved += abs(inverse[r, j]) * (legs[h, j].max() + leg_error)
            most = max(most, moved / (weight if r < 3 else 1.0))
            most_p = max(most_p, moved if r < 3 else 0.0)
        sensitivity[h] = (most_p + weight * share / (1.0 - share) * most) * (1.0 + ROUND)
