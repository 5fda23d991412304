"""Enclosure of the poses of a platform while its legs keep within given lengths, by Krawczyk's operator.

With x = (p, i), x̃ a pose, d_j = p̃ + z_j ĩ − a_j and δ = x − x̃, the leg equations are exactly quadratic:

    ½(|d_j|² − l_j²) + d_j·(δp + z_j δi) + ½|δp + z_j δi|² = 0,   ½(|ĩ|² − 1) + ĩ·δi + ½|δi|² = 0.

A leg that ends on a ring of radius r around the line adds −r ρ, ρ = |(p − a_j) × i|: its gradient is part of J, and
a bound of its second derivative is added to q (lemma 15).

So δ = (1 − C J) δ − C (g + ½q(δ)) with J the matrix of the linear part and C nearly its inverse. Where that maps the
ball |δp| ≤ P, |δi| ≤ Q into itself and contracts it, for every choice of lengths there is exactly one pose in the ball,
and it depends continuously on them (Banach): legs that move within these lengths, and pass x̃, keep the platform in the
ball. Lemma 9 of docs/proofs.md. The bounds are computed in floating point; what rounding may have taken from d, from
1 − C J and from sums that cancel is added, in proportion to the numbers that enter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_batch, row_lengths
from pentapod.kinematics.jacobian import invert
from pentapod.kinematics.tubes.leg_equations import BuiltLegs

_U = 2.0**-53
ROUND_UP = 1.0 + 1e-9
"""Factor that exceeds the rounding of sums of positive terms."""

BALL_ITERATIONS = 6
"""How often the ball is enlarged before it is tested; more make the bounds no closer."""


def pose_enclosure(
    robot: BuiltLegs, position: ArrayLike, direction: ArrayLike, legs: ArrayLike, offsets: ArrayLike
) -> tuple[Floats, Floats]:
    """Return bounds of how far points of the platform line (N, K) and i (N,) get from where they are.

    position, direction (N, 3): poses. legs (N, M, 5): metres; at all times the five readings together are in the
    convex hull of these M (Bernstein coefficients, say), and so are those of the pose. offsets (K,): of the points
    along the line, metres. Infinite where nothing is proven: the lengths change too much for this, or the pose is
    close to a singularity.
    """
    p, i = as_batch(position, "position", (None, 3)), as_batch(direction, "direction", (None, 3))
    readings, along = as_batch(legs, "legs", (None, None, 5)), as_batch(offsets, "offsets", (None,))
    with np.errstate(all="ignore"):
        z, lengths = robot.offsets, readings - robot.zeros
        d = p[..., None, :] + z[:, None] * i[..., None, :] - robot.base_joints
        # Where the base is far off, d has lost digits: by so many metres each vector may be wrong (N, 5).
        far = np.linalg.norm(p, axis=1)[:, None] + np.linalg.norm(robot.base_joints, axis=1) + 2.0 * np.abs(z)
        wrong = 4.0 * _U * far * ROUND_UP
        here = row_lengths(d)
        last = np.concatenate([np.zeros_like(i), i], axis=-1)[:, None]
        by_pose, rings = np.concatenate([d, z[:, None] * d], axis=-1), _Rings.of(robot, p, i)
        if rings is not None:
            by_pose -= rings.gradient
            here = np.sqrt(here * here + rings.radii * (rings.radii - 2.0 * rings.distance))
            wrong = wrong + 64.0 * _U * rings.radii * (1.0 + far)
        jacobian = np.concatenate([by_pose, last], axis=1)
        c = invert(jacobian, np.nan)
        # ½(l² − |d|²) = |d| e + ½ e², e = l − |d|: the first part of all legs together, the second of each.
        change = lengths - here[:, None]
        linear = here[:, None] * change
        largest = np.concatenate([np.abs(linear).max(axis=1), np.zeros((len(p), 1))], axis=1)
        length = wrong + 8.0 * _U * here  # by how much |d| may be wrong
        bent = (0.5 * np.square(change).max(axis=1) + length * (here + length) + 16.0 * _U * largest[:, :5]) * ROUND_UP
        unit = 0.5 * np.abs(np.einsum("nk,nk->n", i, i)[:, None] - 1.0) + 8.0 * _U
        rest = np.concatenate([bent, unit * ROUND_UP], axis=1)
        off = _defect(c, jacobian, wrong, z)

        def moved(rows: Floats, size: Floats, residual: Floats) -> Floats:
            """Return the largest |rows · (linear + residual)| (N,), rows (N, 3, 6), for residuals (N, 6) of any sign.

            size (N, 3, 6): what the rows are sums of, all counted as positive, for the rounding of these sums.
            """
            straight = row_lengths(linear @ rows[:, :, :5].swapaxes(1, 2)).max(axis=1)
            lost = (np.linalg.norm(size, axis=1) * (16.0 * _U * (largest + residual))).sum(axis=1)
            return (straight + (np.linalg.norm(rows, axis=1) * residual).sum(axis=1) + lost) * ROUND_UP

        def by_defect(rows: Floats, ball: Floats) -> Floats:
            """Return how far (N,) `rows` (N, 3, 6) of 1 − C J move p or i, for |δp| and |δi| (N,) in `ball`."""
            sums = rows[:, :, :3].sum(axis=2) * ball[0][:, None] + rows[:, :, 3:].sum(axis=2) * ball[1][:, None]
            return np.linalg.norm(sums, axis=1) * ROUND_UP

        by_p, by_i = (np.linalg.norm(part, axis=1) * ROUND_UP for part in (c[:, :3], c[:, 3:]))
        first = moved(c[:, :3], np.abs(c[:, :3]), rest), moved(c[:, 3:], np.abs(c[:, 3:]), rest)
        large, turn = first[0].copy(), first[1].copy()
        lever = np.append(np.abs(z), 1.0)

        def next_ball() -> tuple[Floats, Floats, Floats]:
            """Return |δp + z_j δi|² (N, 6), of the last equation |δi|², and what the ball adds to p and i (N,)."""
            reach = large[:, None] * np.append(np.ones(5), 0.0) + turn[:, None] * lever
            bend, ball = reach * reach, np.stack([large, turn])
            if rings is not None:
                bend[:, :5] += rings.bend(large[:, None], turn[:, None])
            return (
                bend,
                (by_p * bend).sum(axis=1) + by_defect(off[:, :3], ball),
                (by_i * bend).sum(axis=1) + by_defect(off[:, 3:], ball),
            )

        # q and not q/2: the change of q/2 over the ball is bounded by that too, so the map contracts.
        for _ in range(BALL_ITERATIONS):
            _, more_p, more_i = next_ball()
            large, turn = first[0] * (1.0 + 1e-6) + more_p * 1.05, first[1] * (1.0 + 1e-6) + more_i * 1.05
        bend, more_p, more_i = next_ball()
        proven = ((first[0] + more_p) * ROUND_UP < large) & ((first[1] + more_i) * ROUND_UP < turn)
        rest, ball = (rest + 0.5 * bend) * ROUND_UP, np.stack([large, turn])
        points = [
            moved(c[:, :3] + k * c[:, 3:], np.abs(c[:, :3]) + abs(k) * np.abs(c[:, 3:]), rest)
            + by_defect(off[:, :3] + abs(k) * off[:, 3:], ball)
            for k in along
        ]
        turned = moved(c[:, 3:], np.abs(c[:, 3:]), rest) + by_defect(off[:, 3:], ball)
        return np.where(proven[:, None], np.stack(points, axis=1) * ROUND_UP, np.inf), np.where(
            proven, turned * ROUND_UP, np.inf
        )


@dataclass(frozen=True, eq=False)
class _Rings:
    """r ρ of the legs: radii (5,), ρ and |p − a| (N, 5), and the gradient of r ρ (N, 5, 6)."""

    radii: Floats
    distance: Floats
    depth: Floats
    gradient: Floats

    @classmethod
    def of(cls, robot: BuiltLegs, p: Floats, i: Floats) -> _Rings | None:
        """Return them for poses (N, 3), or None for a robot without rings."""
        radii = robot.radii
        if not radii.any():
            return None
        d = p[:, None] - robot.base_joints
        normal = np.asarray(np.cross(d, i[:, None]), dtype=np.float64)
        distance = np.linalg.norm(normal, axis=2)
        normal /= distance[..., None]
        gradient = np.concatenate([np.cross(i[:, None], normal), np.cross(normal, d)], axis=2)
        gradient = np.where(radii[:, None] > 0.0, radii[:, None] * gradient, 0.0)
        return cls(radii, np.where(radii > 0.0, distance, 0.0), np.linalg.norm(d, axis=2), gradient)

    def bend(self, large: Floats, turn: Floats) -> Floats:
        """Return r times the largest second derivative of ρ (N, 5) for changes of p and i in the ball, and in it."""
        far, unit = self.depth + large, 1.0001 + turn
        change = large * unit + far * turn
        nearest = self.distance - change
        most = change * change / nearest + 2.0 * large * turn
        most = np.where(nearest > far / 16.0, most, np.inf)
        return np.where(self.radii > 0.0, self.radii * most, 0.0)


def _defect(c: Floats, jacobian: Floats, wrong: Floats, z: Floats) -> Floats:
    """Return bounds (N, 6, 6) of |1 − C J|, J the exact Jacobian, from which the computed one may differ.

    wrong (N, 5): metres by which the legs' vectors may be.
    """
    size, computed = np.abs(c), np.abs(np.eye(6) - c @ jacobian)
    slack = wrong[..., None] * np.concatenate([np.ones((5, 3)), np.repeat(np.abs(z)[:, None], 3, axis=1)], axis=1)
    slack = np.concatenate([slack, np.zeros((len(c), 1, 6))], axis=1) + 16.0 * _U * np.abs(jacobian)
    return (computed + size @ slack + 2.0 * _U) * ROUND_UP
