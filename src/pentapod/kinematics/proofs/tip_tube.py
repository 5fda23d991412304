"""Tubes around the motion of a leg program: bounds of where the tool is at all times, not only at samples.

On each interval the legs are polynomials in time. The pose that they give is not, but some polynomial x̃(t) in p and i
comes close, which is proven afterwards. With the leg equations G(x, t) = (½(|p + z_j i − a_j|² − l_j(t)²),
½(|i|² − 1)), J their Jacobian and C ≈ J⁻¹ in the middle of the interval, both

    y ≥ |C G(x̃(t), t)| for all t (G along x̃ is itself a polynomial: its Bernstein coefficients bound it),
    Z ≥ |1 − C J(x)| for all x within ρ of x̃(t) for some t,

are bounded component by component, in ball arithmetic. If y + Z ρ < ρ, then for every t there is exactly one
solution within ρ of x̃(t) (Krawczyk 1969; lemma 7 of docs/proofs.md), it is within y + Z ρ, and it depends
continuously on t. If w and S keep the
component's signs all over the tube, the solution is the pose of the component: lengths have one pose in each.
Where this fails, the interval is halved.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats, Ints, as_floats
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.kinematics.batches import as_motion
from pentapod.kinematics.component import as_component
from pentapod.kinematics.jacobian import invert
from pentapod.kinematics.proofs.tip_deviation import angle_bound, distance_bound
from pentapod.kinematics.tubes.leg_equations import PosedQuadraticLegs
from pentapod.numerics.ball_bernstein import blossom, elevate, hull, multiply, restricted
from pentapod.numerics.balls import ROUND_UP, Ball
from pentapod.numerics.blocks import blocks


@dataclass(frozen=True, eq=False)
class TipTube(Value):
    """What is proven of N intervals, in M pieces of them.

    proven (N,): on the whole interval the legs give one continuous motion in the component, inside the tube.
    interval (M,), start, width (M,): the pieces, as parts of [0, 1] of their interval; only of proven intervals.
    position (m + 1, 3, M) metres, direction (m + 1, 3, M): Bernstein coefficients of x̃ on the piece.
    position_error (3, M) metres, direction_error (3, M): by how much the true pose may differ from x̃ at any time.
    """

    proven: Bools
    interval: Ints
    start: Floats
    width: Floats
    position: Floats
    direction: Floats
    position_error: Floats
    direction_error: Floats

    def tip_deviation(self, path: ArrayLike, about: float) -> Floats:
        """Return proven upper bounds (N,) in metres of the tip's distance from a path, at equal times.

        path (N, 3, n + 1): Bernstein coefficients in metres of where the point p + about · i should be on each
        interval; about: metres along the line from p, the tool length for the tip. Infinite where nothing is proven.
        Raises ArrayError for a wrong shape.
        """
        wanted = self._coefficients(path, "path")
        tip = Ball.exact(self.position) + Ball.exact(self.direction) * about
        error = (self.position_error + abs(about) * self.direction_error) * ROUND_UP
        return self._worst(distance_bound(tip, wanted, error), np.inf)

    def axis_deviation(self, axes: ArrayLike) -> Floats:
        """Return proven upper bounds (N,) in radians of the angle between the line's direction i and given ones.

        axes (N, 3, n + 1): Bernstein coefficients of directions, not necessarily of unit length, platform to tip as i
        is. π where no angle below a right one is proven. Raises ArrayError for a wrong shape.
        """
        wanted = self._coefficients(axes, "axes")
        return self._worst(angle_bound(Ball.exact(self.direction), wanted, self.direction_error), np.pi)

    def _coefficients(self, value: ArrayLike, name: str) -> Ball:
        """Return the given polynomials on the pieces, (n + 1, 3, M)."""
        given = as_floats(value, name, (None, 3, None))
        if given.ndim != 3 or len(given) != len(self.proven) or given.shape[-1] < 1:
            raise ArrayError(f"{name} has shape {given.shape}", expected=f"shape ({len(self.proven)}, 3, n + 1)")
        pieces = Ball.exact(np.moveaxis(given[self.interval], 0, -1).swapaxes(0, 1))
        return restricted(pieces, self.start, self.width)

    def _worst(self, bounds: Floats, unproven: float) -> Floats:
        worst = np.where(self.proven, 0.0, unproven)
        np.maximum.at(worst, self.interval, bounds)
        return worst


def prove_tip_tube(
    pentapod: PosedQuadraticLegs,
    leg_coefficients: ArrayLike,
    component: ArrayLike,
    *,
    leg_error: float = 0.0,
    depth: int = 8,
) -> TipTube:
    """Enclose the motion that legs describe in a component, interval by interval.

    leg_coefficients (N, 5, k + 1): Bernstein coefficients in metres, as for `certify_component`. component: a
    `Component` or two signs. leg_error: metres by which each actual leg may differ from its polynomial at any
    time: the tube then holds every such motion. depth: how often an interval may be halved.
    Raises ArrayError for a wrong shape, numbers that are not finite, a negative leg_error or depth.
    """
    legs = as_motion(as_floats(leg_coefficients, "leg_coefficients"))
    signs = np.array(as_component(component), dtype=np.float64)
    if not (0.0 <= leg_error < np.inf and depth >= 0):
        raise ArrayError("leg_error and depth must not be negative", value=(leg_error, depth))
    done: list[tuple[Ints, Floats, Floats, tuple[Floats, ...]]] = []
    lost = np.zeros(len(legs), dtype=np.bool_)
    owner, start, width = np.arange(len(legs)), np.zeros(len(legs)), 1.0
    for level in range(depth + 1):
        failed = np.zeros(len(owner), dtype=np.bool_)
        for block in blocks(max(1, len(owner)), 1024):
            part = Ball.exact(np.moveaxis(legs[owner[block]], 0, -1).swapaxes(0, 1))
            widths = np.full(len(owner[block]), width)
            with np.errstate(all="ignore"):
                found, good = _prove(pentapod, restricted(part, start[block], widths), signs, leg_error)
            kept = tuple(array[..., good] for array in found)
            done.append((owner[block][good], start[block][good], widths[good], kept))
            failed[block] = ~good
        owner, start = owner[failed], start[failed]
        if level < depth:
            width *= 0.5
            owner, start = np.concatenate([owner, owner]), np.concatenate([start, start + width])
        if not len(owner):
            break
    lost[owner] = True
    interval = np.concatenate([piece[0] for piece in done])
    keep = ~lost[interval]
    starts = np.concatenate([piece[1] for piece in done])[keep]
    widths = np.concatenate([piece[2] for piece in done])[keep]
    arrays = [np.concatenate([piece[3][n] for piece in done], axis=-1)[..., keep] for n in range(4)]
    return TipTube(np.asarray(~lost), interval[keep], starts, widths, arrays[0], arrays[1], arrays[2], arrays[3])


def _prove(
    pentapod: PosedQuadraticLegs, legs: Ball, signs: Floats, leg_error: float
) -> tuple[tuple[Floats, Floats, Floats, Floats], Bools]:
    """Return x̃ as p and i (m + 1, 3, N), the errors of both (3, N), and where they are proven (N,).

    legs (k + 1, 5, N).
    """
    k, count = len(legs.mid) - 1, legs.mid.shape[-1]
    p, i = _fitted(pentapod, legs, signs, k + 3)
    offsets = pentapod.offsets[:, None, None]
    attachments = pentapod.base_joints[..., None]
    joints = Ball.exact(p)[:, None] + Ball.exact(i)[:, None] * offsets - attachments  # (m + 1, 5, 3, N)
    squares = multiply(joints, joints)
    lengths = multiply(legs, legs)
    g = (_sum(squares, 2) - elevate(lengths, len(squares.mid) - len(lengths.mid))) * 0.5  # (2m + 1, 5, N)
    unit = (_sum(multiply(Ball.exact(i), Ball.exact(i)), 1) - 1.0) * 0.5

    middle = [blossom(x, [np.full(count, 0.5)] * (len(p) - 1)).mid for x in (joints, Ball.exact(i))]
    inverse = invert(_stacked(middle[0], pentapod.offsets[:, None, None] * middle[0], middle[1]), np.nan)  # (N, 6, 6)
    columns = Ball(
        np.concatenate([g.mid, unit.mid[:, None]], axis=1).transpose(2, 1, 0),
        np.concatenate([g.rad, unit.rad[:, None]], axis=1).transpose(2, 1, 0),
    )
    y = (inverse @ columns).magnitude.max(axis=-1)  # (N, 6)
    if leg_error > 0.0:
        longest = np.maximum(np.abs(legs.lower), np.abs(legs.upper)).max(axis=0)
        loose = (longest + leg_error) * leg_error * ROUND_UP  # ½ (l + e)² − ½ l², and more
        y = (y + np.einsum("nrl,ln->nr", np.abs(inverse[:, :, :5]), loose) * ROUND_UP) * ROUND_UP

    scale = np.repeat([float(np.abs(pentapod.base_joints - pentapod.base_joints[2]).max()), 1.0], 3)
    largest = (y / scale).max(axis=1, keepdims=True) + 2.0**-50
    radius = (y + 0.5 * largest * scale) * ROUND_UP
    p_hull, i_hull = hull(Ball.exact(p)).widened(radius[:, :3].T), hull(Ball.exact(i)).widened(radius[:, 3:].T)
    rows = p_hull + i_hull * offsets - attachments
    rough = hull(joints).widened((radius[:, :3].T + np.abs(offsets) * radius[:, 3:].T) * ROUND_UP)
    narrow = rough.rad < rows.rad  # both enclose the same; their own curves are narrower where p and i move together
    rows = Ball(np.where(narrow, rough.mid, rows.mid), np.where(narrow, rough.rad, rows.rad))
    z = (np.eye(6) - inverse @ _ball_jacobian(rows, i_hull, pentapod.offsets)).magnitude
    error = (y + np.einsum("nij,nj->ni", z, radius) * ROUND_UP) * ROUND_UP
    w, s = i_hull[2], _s(pentapod, p_hull, i_hull)
    sided = ((w * signs[0]).lower > 0.0) & ((s * signs[1]).lower > 0.0)
    return (p, i, error[:, :3].T, error[:, 3:].T), (error < radius).all(axis=1) & sided


def _fitted(pentapod: PosedQuadraticLegs, legs: Ball, signs: Floats, m: int) -> tuple[Floats, Floats]:
    """Return Bernstein coefficients (m + 1, 3, N) of polynomials through the poses at m + 1 Chebyshev nodes."""
    nodes = 0.5 - 0.5 * np.cos(np.pi * np.arange(m + 1) / m)
    at = np.stack([blossom(legs, [np.full(1, t)] * (len(legs.mid) - 1)).mid for t in nodes])  # (m + 1, 5, N)
    position, direction = pentapod.pose(np.moveaxis(at, 1, -1), signs)
    basis = np.stack([blossom(Ball.exact(np.eye(m + 1)), [np.full(1, t)] * m).mid for t in nodes])
    weights = np.linalg.inv(basis)
    fitted = [np.einsum("jn,nbc->jcb", weights, values) for values in (position, direction)]
    return fitted[0], fitted[1]


def _stacked(rows: Floats, scaled: Floats, i: Floats) -> Floats:
    """Return the Jacobian (N, 6, 6): rows [d_j, z_j d_j], then [0, i], of d and z d (5, 3, N) and i (3, N)."""
    last = np.concatenate([np.zeros_like(i), i])
    return np.concatenate([np.concatenate([rows, scaled], axis=1), last[None]]).transpose(2, 0, 1)


def _ball_jacobian(rows: Ball, i: Ball, offsets: Floats) -> Ball:
    """Return `_stacked` of balls."""
    scaled = rows * offsets[:, None, None]
    return Ball(_stacked(rows.mid, scaled.mid, i.mid), _stacked(rows.rad, scaled.rad, i.rad))


def _s(pentapod: PosedQuadraticLegs, p: Ball, i: Ball) -> Ball:
    """Return S (N,) of p and i (3, N): see `quadratic.w_and_s`, with z_3 − δ x_3 rounded outwards."""
    delta = pentapod.delta
    lever = Ball.exact(pentapod.offsets[2]) - Ball.exact(pentapod.base_joints[2, 0]) * delta
    return i[2] * p[0] * delta + (1.0 - i[0] * delta) * p[2] + lever * i[2]


def _sum(a: Ball, axis: int) -> Ball:
    """Return the sum over an axis of length 3."""
    x, y, z = (Ball(np.take(a.mid, n, axis=axis), np.take(a.rad, n, axis=axis)) for n in range(3))
    return x + y + z
