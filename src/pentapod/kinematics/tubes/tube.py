"""One step of a verified path: a tube around a straight line of poses, with exactly one solution in it at each moment.

A family of leg equations G(x, s) = 0, s in [0, 1], x = (p, i): the geometry, the leg lengths or both change with s.
Given approximate solutions x_0 and x_1 at the ends, let x̃(s) = x_0 + s (x_1 − x_0), C ≈ (∂G/∂x)⁻¹ at the middle, and
measure changes of x by ‖(p, i)‖ = max(|p_j| / scale, |i_j|). If

    Y ≥ ‖C G(x̃(s), s)‖ for all s,    Z ≥ ‖1 − C ∂G/∂x(x, s)‖ for all s and ‖x − x̃(s)‖ ≤ R,    Y + Z R < R,  Z < 1,

then for every s the map x → x − C G(x, s) carries the ball of radius R around x̃(s) into its interior and contracts: it
contains exactly one solution (Krawczyk 1969, Newton-Kantorovich; lemma 7 of docs/proofs.md). ∂G/∂x is regular
throughout, so the solutions form one continuous curve, and no singularity lies in the tube.

The balls at the shared end of two consecutive tubes have one centre and one shape, so one contains the other, and
both their solutions are the same: tubes that meet end to end enclose one continuous curve (lemma 10).

Y uses the mean value theorem, |C G(x̃(s), s)| ≤ |C G(x̃(½), ½)| + ½ |C dG/ds|, so it is of second order in the step.
All bounds are computed in ball arithmetic: they are proofs in spite of rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.kinematics.jacobian import invert
from pentapod.kinematics.tubes.leg_equations import (
    LegEquationRows,
    Legs,
    ball_jacobian,
    dot,
    float_jacobian,
    masked,
    mids,
    residuals,
    rows,
)
from pentapod.numerics.balls import ROUND_UP, Ball


@dataclass(frozen=True, eq=False)
class LegFamily:
    """Legs that change with s: at s = ½, all that they are for s in [0, 1], and how fast they change there.

    slack (5, N): metres by which each length may besides differ from what the others say, at any s.
    """

    middle: Legs[Ball]
    hull: Legs[Ball]
    slope: Legs[Ball]
    slack: Floats


@dataclass(frozen=True, eq=False)
class Tube:
    """What was proven of N steps.

    proven (N,). radius (N,): R. contraction (N,): Z. inverse (N, 6, 6): C. Undefined where not proven.
    """

    proven: Bools
    radius: Floats
    contraction: Floats
    inverse: Floats


def prove_tube(
    start: tuple[Floats, Floats], end: tuple[Floats, Floats], family: LegFamily, scale: float, tries: int = 2
) -> Tube:
    """Try to prove a tube from poses `start` to poses `end`, each positions and directions (3, N), plain arrays.

    scale: metres, a power of two. tries: how many radii are tried.
    """
    (p0, i0), (p1, i1) = start, end
    p_mid, i_mid = (Ball.exact(p0) + p1) * 0.5, (Ball.exact(i0) + i1) * 0.5
    p_hull, i_hull = Ball.between(p0, p1), Ball.between(i0, i1)
    dp, di = Ball.exact(p1) - p0, Ball.exact(i1) - i0

    at_middle = rows(p_mid.mid, i_mid.mid, mids(family.middle))
    inverse = invert(float_jacobian(at_middle, i_mid.mid, scale), np.nan)
    ends = residuals(p_mid, i_mid, family.middle)
    off = _largest(inverse @ _column(ends, (dot(i_mid, i_mid) - 1.0) * 0.5))
    length = family.hull.lengths.magnitude
    loose = (length + family.slack) * family.slack * ROUND_UP  # ½ (l + slack)² − ½ l², and more
    off = (off + (np.abs(inverse[:, :, :5]) @ loose.T[..., None])[..., 0].max(axis=-1) * ROUND_UP) * ROUND_UP

    reach = np.maximum(dp.magnitude.max(axis=0) / scale, di.magnitude.max(axis=0))
    radius = 0.5 * reach + 2.0 * off + 2.0**-48
    proven = np.zeros(len(radius), dtype=bool)
    kept, contraction = radius, radius
    for _ in range(tries):
        p, i = p_hull.widened(radius * scale * ROUND_UP), i_hull.widened(radius)
        found = rows(p, i, family.hull)
        along = _change(found, dp, di, i, family)
        drift = _largest(inverse @ _column(along, dot(i, di)))
        y = (off + 0.5 * drift) * ROUND_UP
        product = inverse @ ball_jacobian(found, i, scale)
        z = ((np.eye(6) - product).magnitude.sum(axis=-1) * ROUND_UP).max(axis=-1)
        good = ((y + z * radius) * ROUND_UP < radius) & (z < 1.0)
        kept, contraction = np.where(good & ~proven, radius, kept), np.where(good & ~proven, z, contraction)
        proven |= good
        if proven.all():
            break
        wanted = 1.05 * y / (1.0 - z)
        radius = np.where(proven | ~((z < 0.95) & (wanted < 2.0 * radius)), radius, wanted)
    return Tube(proven, kept, contraction, inverse)


def error_bound(tube: Tube, pose: tuple[Floats, Floats], legs: Legs[Ball]) -> Floats:
    """Return how far (N,) at most each pose, an end of its tube, is from the tube's solution there; legs: those there.

    In the tube's norm: times scale for metres, as it is for the direction. NaN where the tube is not proven.
    """
    p, i = Ball.exact(pose[0]), Ball.exact(pose[1])
    off = _largest(tube.inverse @ _column(residuals(p, i, legs), (dot(i, i) - 1.0) * 0.5))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(tube.proven, off / (1.0 - tube.contraction) * ROUND_UP, np.nan)


def sensitivity(tube: Tube, family: LegFamily, scale: float) -> Floats:
    """Return bounds (2, N) of how fast any coordinate of p, and of i, moves within the tube when all legs change.

    Metres, and no unit, for each metre of the leg that changes most. With ∂G_k/∂l_k = −l_k and E = 1 − C ∂G/∂x,
    ‖E‖ ≤ Z, the pose changes by (1 − E)⁻¹ C l = C l + E (1 − E)⁻¹ C l. Infinite where the tube is not proven.
    """
    lengths = (family.hull.lengths.magnitude + family.slack) * ROUND_UP
    moves = (np.abs(tube.inverse[:, :, :5]) @ lengths.T[..., None])[..., 0].T  # (6, N)
    with np.errstate(divide="ignore", invalid="ignore"):
        rest = tube.contraction / (1.0 - tube.contraction) * moves.max(axis=0)
    both = np.stack([scale * (moves[:3].max(axis=0) + rest), moves[3:].max(axis=0) + rest]) * ROUND_UP
    return np.where(tube.proven, both, np.inf)


def proven_jacobian_signs(pose: tuple[Floats, Floats], legs: Legs[Ball], slack: Floats, scale: float) -> Ints:
    """Return the sign (N,) of det ∂G/∂(p, i) at the exact poses next to the given ones; 0 where it is not proven.

    Lemma 11 of docs/proofs.md: it tells on which side of the singularities a pose is.

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


def _change(found: LegEquationRows[Ball], dp: Ball, di: Ball, i: Ball, family: LegFamily) -> Ball:
    """Return dG_k/ds (5, N) along the line of poses, for all s."""
    hull, slope = family.hull, family.slope
    change = dot(found.by_position, dp[:, None] - slope.base) + dot(found.by_direction, di[:, None])
    change = change + dot(found.e, i[:, None]) * slope.offsets - hull.lengths * slope.lengths
    if hull.rings.any():
        change = change + masked((hull.radii - found.rho) * slope.radii, hull.rings)
    return change


def _column(legs: Ball, unit: Ball) -> Ball:
    """Return (N, 6, 1) of five rows (5, N) and a sixth (N,)."""
    mid = np.concatenate([np.broadcast_to(legs.mid, (5, *unit.mid.shape)), unit.mid[None]])
    rad = np.concatenate([np.broadcast_to(legs.rad, (5, *unit.rad.shape)), unit.rad[None]])
    return Ball(mid.T[..., None], rad.T[..., None])


def _largest(columns: Ball) -> Floats:
    """Return the maximum norm (N,), rounded up, of columns (N, 6, 1)."""
    return columns.magnitude[..., 0].max(axis=-1)
