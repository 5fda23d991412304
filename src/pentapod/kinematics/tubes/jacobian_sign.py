"""On which side of the singularities poses are: the sign of the Jacobian's determinant, with a proof.

Lemma 11 of docs/proofs.md.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.kinematics.tubes.leg_equations import Legs
from pentapod.kinematics.tubes.tube import LegFamily, prove_tube
from pentapod.numerics.balls import Ball


def proven_sides(pose: tuple[Floats, Floats], legs: Legs[Ball], slack: Floats, scale: float) -> Ints:
    """Return the sign (N,) of det ∂G/∂(p, i) at the exact poses next to the given ones; 0 where it is not proven.

    pose: positions and directions (3, N). slack: metres by which each leg (5, 1) may differ from `legs`: the sign is
    that of every pose which such legs have there. In a tube of no length ‖1 − C ∂G/∂x‖ < 1, so det C has the sign.
    """
    still = Ball.exact(np.zeros((1, 1)))
    slope = Legs(still[None] * np.zeros((3, 1, 1)), still, still, still, legs.rings)
    tube = prove_tube(pose, pose, LegFamily(legs, legs, slope, slack), scale)
    return np.where(tube.proven, determinant_sign(tube.inverse), 0)


def determinant_sign(matrices: Floats) -> Ints:
    """Return the signs (N,) of the determinants of matrices (N, n, n), n ≤ 12, whose entries are exact; 0 if in doubt.

    Gauss's elimination in ball arithmetic: the sign is proven where no pivot's ball contains zero.
    """
    left, sign, at = Ball.exact(matrices), np.ones(len(matrices), dtype=np.intp), np.arange(len(matrices))
    for size in range(matrices.shape[-1], 0, -1):
        row = np.argmax(np.abs(left.mid[:, :, 0]), axis=1)
        pivots = left[at, row]
        first = pivots[:, 0]
        clear = np.abs(first.mid) > first.rad
        sign = sign * np.where(clear, np.sign(np.where(clear, first.mid, 0.0)), 0.0).astype(np.intp)
        sign = np.where(row % 2 == 1, -sign, sign)  # the pivot's row goes on top, the others keep their order
        others = np.argsort(np.arange(size) == row[:, None], axis=1, kind="stable")[:, : size - 1]
        rest = left[at[:, None], others]
        left = rest[:, :, 1:] - (rest[:, :, :1] / first[:, None, None]) * pivots[:, None, 1:]
    return sign
