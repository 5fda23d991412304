"""How far a platform may stray while its legs keep within given lengths: for proofs over stretches of time.

With x = (p, i), x̃ a pose, d_j = p̃ + z_j ĩ − a_j and δ = x − x̃, the leg equations are exactly quadratic:

    ½(|d_j|² − l_j²) + d_j·(δp + z_j δi) + ½|δp + z_j δi|² = 0,   ½(|ĩ|² − 1) + ĩ·δi + ½|δi|² = 0.

So δ = −C(g + ½q(δ)) with C the inverse of the matrix of the linear part. Where that maps the ball |δp| ≤ P, |δi| ≤ Q
into itself and contracts it, for every choice of lengths there is exactly one pose in the ball, and it depends
continuously on them (Banach): legs that move within these lengths, and pass x̃, keep the platform in the ball.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.arrays import Floats, as_batch
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.kinematics.jacobian import invert

_ROUNDS = 6
_UP = 1.0 + 1e-9  # for what rounding takes
_HAIR = 1e-12


def roaming(
    pentapod: FiveLegs, position: ArrayLike, direction: ArrayLike, lengths: ArrayLike, offsets: ArrayLike
) -> tuple[Floats, Floats]:
    """Return how far (N, K) points of the platform line get from where they are, at most, and how far (N,) i does.

    position, direction (N, 3): poses. lengths (N, M, 5): metres; at all times the five leg lengths together are in
    the convex hull of these M (Bernstein coefficients, say), and so are those of the pose. offsets (K,): of the points
    along the line, metres. Infinite where nothing is proven: the lengths change too much for this, or the pose is
    close to a singularity.
    """
    p, i = as_batch(position, "position", (None, 3)), as_batch(direction, "direction", (None, 3))
    legs, along = as_batch(lengths, "lengths", (None, None, 5)), as_batch(offsets, "offsets", (None,))
    with np.errstate(all="ignore"):
        d = pentapod.leg_vectors(p, i)
        here = np.linalg.norm(d, axis=2)
        z = pentapod.offsets
        last = np.concatenate([np.zeros_like(i), i], axis=-1)[:, None]
        c = invert(np.concatenate([np.concatenate([d, z[:, None] * d], axis=-1), last], axis=1), np.nan)
        # ½(l² − |d|²) = |d| e + ½ e², e = l − |d|: the first part of all legs together, the second of each.
        change = legs - here[:, None]
        linear = here[:, None] * change
        bent = 0.5 * np.square(change).max(axis=1) * _UP + _HAIR
        unit = 0.5 * np.abs(np.einsum("nk,nk->n", i, i)[:, None] - 1.0) + _HAIR
        rest = np.concatenate([bent, unit], axis=1)

        def moved(rows: Floats, residual: Floats) -> Floats:
            """Return the largest |rows · what is off| (N,), rows (N, 3, 6), with a residual (N, 6) of any sign."""
            straight = np.linalg.norm(linear @ rows[:, :, :5].swapaxes(1, 2), axis=2).max(axis=1)
            return (straight + (np.linalg.norm(rows, axis=1) * residual).sum(axis=1)) * _UP

        by_p, by_i = (np.linalg.norm(part, axis=1) * _UP for part in (c[:, :3], c[:, 3:]))
        first = moved(c[:, :3], rest), moved(c[:, 3:], rest)
        large, turn = first[0].copy(), first[1].copy()
        lever = np.append(np.abs(z), 1.0)

        def bends() -> Floats:
            """Return |δp + z_j δi|² (N, 6), of the last equation |δi|²."""
            reach = large[:, None] * np.append(np.ones(5), 0.0) + turn[:, None] * lever
            return reach * reach

        # q and not q/2: the change of q/2 over the ball is bounded by that too, so the map contracts.
        for _ in range(_ROUNDS):
            bend = bends()
            large = first[0] * (1.0 + 1e-6) + (by_p * bend).sum(axis=1) * 1.05
            turn = first[1] * (1.0 + 1e-6) + (by_i * bend).sum(axis=1) * 1.05
        bend = bends()
        proven = (first[0] + (by_p * bend).sum(axis=1) < large) & (first[1] + (by_i * bend).sum(axis=1) < turn)
        rest = rest + 0.5 * bend
        points = np.stack([moved(c[:, :3] + offset * c[:, 3:], rest) for offset in along], axis=1)
        return np.where(proven[:, None], points, np.inf), np.where(proven, moved(c[:, 3:], rest), np.inf)
