"""Krawczyk's test on every interval of a program at once, compiled: what `motion` proves, for short intervals.

Arrays as in `krawczyk_kernels`. The boxes are multiples of one shape, so that those of neighbours
contain one another at the pose between them (lemma 10 of docs/proofs.md).
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.kinematics.krawczyk.krawczyk_kernels import (
    ROUND,
    contracted,
    fill_defect,
    fill_line,
    fill_spread,
    invert,
    line_corrections,
    line_residuals,
    sane,
)
from pentapod.kinematics.proofs.newton_kernels import solved
from pentapod.numerics.kernels import kernel


@kernel
def continued_poses(
    lengths: Floats,
    home_lengths: Floats,
    home: Floats,
    geometry: Floats,
    rings: Floats,
    weight: float,
    bases: tuple[Floats, Floats, Floats, Floats],
    shortest: float,
    poses: Floats,
) -> None:
    """Fill the poses (N, 6) to which the motion along straight lines of lengths (N, 5) leads, NaN where not proven.

    Each begins at the pose before it, and where this proves nothing at home (6,). shortest: step, as a share of a line,
    below which it is given up.
    """
    known = False
    for h in range(len(lengths)):
        if known and _continued(
            lengths[h - 1], poses[h - 1], lengths[h], geometry, rings, weight, bases, shortest, poses[h]
        ):
            continue
        known = _continued(home_lengths, home, lengths[h], geometry, rings, weight, bases, shortest, poses[h])
        if not known:
            poses[h] = np.nan


@kernel
def _continued(
    start: Floats,
    pose: Floats,
    end: Floats,
    geometry: Floats,
    rings: Floats,
    weight: float,
    bases: tuple[Floats, Floats, Floats, Floats],
    shortest: float,
    x: Floats,
) -> bool:
    """Fill the pose x (6,) to which a pose leads while the lengths go from start to end (5,); whether it is proven."""
    first, second, change, step = np.empty((5, 3)), np.empty((5, 3)), np.empty((5, 3)), np.empty(6)
    jacobian, inverse, work, g = np.zeros((6, 6)), np.empty((6, 6)), np.empty((6, 12)), np.empty(6)
    line, ends, proven, sensitivity = np.empty((1, 5, 2)), np.empty((2, 6)), np.zeros(1, np.bool_), np.empty(1)
    ends[0], line[0, :, 0] = pose, start
    done, share = 0.0, 1.0
    while done < 1.0:
        if share < shortest:
            return False
        to = min(done + share, 1.0)
        for j in range(5):
            line[0, j, 1] = end[j] if to == 1.0 else start[j] + to * (end[j] - start[j])
        x[:] = ends[0]
        if solved(x, line[0, :, 1], geometry, rings, first, second, change, step, jacobian, work, inverse, g):
            ends[1] = x
            motions(line, ends, geometry, rings, 0.0, weight, bases, proven, sensitivity)
            if proven[0]:
                done, share = to, 2.0 * share
                ends[0], line[0, :, 0] = x, line[0, :, 1]
                continue
        share *= 0.5
    return True


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
