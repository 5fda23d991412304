"""Proof in continuous time that a motion of the legs meets no singularity, for any geometry near a linear pentapod.

Between two setpoints the legs are polynomials in time. `certify_motion` follows the pose by proven continuation: where
it succeeds, the motion that the legs prescribe exists, is unique and continuous, and meets no singularity, so it stays
in its component. Where the Jacobian's determinant is proven to have different signs at the two ends, every motion from
one to the other meets a singularity. No closed form is needed: general pentapods, base joints off the plane and rings
are all served. For the quadratic family `certify_component` is faster, and bounds |w| and |S|; here the bound is of how
far leg errors move the pose.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Bools, Floats, Ints, as_batch, as_floats
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.kinematics.batches import as_motion
from pentapod.kinematics.proof_results import BranchProof, ProofResult, ProvenMeasure
from pentapod.kinematics.proofs.chords import kernel_bases, kernel_geometry, kernel_rings
from pentapod.kinematics.tubes.continuation import ContinuationOptions, continue_poses
from pentapod.kinematics.tubes.leg_equations import BuiltLegs, Legs, length_scale, mids, newton
from pentapod.kinematics.tubes.tube import LegFamily, proven_jacobian_signs
from pentapod.numerics.ball_bernstein import blossom, hull, restricted, stack
from pentapod.numerics.balls import Ball
from pentapod.numerics.blocks import blocks


@dataclass(frozen=True, eq=False)
class MotionProof(Value, ProofResult):
    """What is proven of N intervals of a motion of the legs.

    proven (N,): from the exact pose next to the interval's first one in `position` and `direction` the motion is
    defined and continuous throughout, ends at the exact pose next to the second one, and its Jacobian is never
    singular. Where all are proven, this holds for the whole of them: the motion stays in the component it begins in.
    refuted (N,): proven not to be so: the Jacobian's determinant has opposite signs at these two poses, so that every
    continuous motion from one to the other, whatever its legs do on the way, meets a singularity (or a pose in which
    the base joint of a ring lies on the line). What is neither is `undecided`.
    position, direction (N + 1, 3): the poses at the intervals' ends, from those given by Newton's method; NaN where it
    did not settle.
    reached (N,): the share of each interval up to which the proof goes: 1 where proven. What comes after is not proven:
    the motion comes near a singularity there, or the pose is lost.
    stop (N,): where the proof was tried in vain, [reached, stop] of the interval; 1 where proven.
    position_sensitivity, direction_sensitivity (N,): proven for as far as the proof goes: legs that differ by up to a
    metre each move no coordinate of p by more metres, and none of i by more, than this. Infinite where nothing is
    proven.
    """

    proven: Bools
    refuted: Bools
    position: Floats
    direction: Floats
    reached: Floats
    stop: Floats
    position_sensitivity: Floats
    direction_sensitivity: Floats

    def __post_init__(self) -> None:
        for array in (getattr(self, field.name) for field in fields(self)):
            array.flags.writeable = False


def certify_motion(
    machine: BuiltLegs,
    leg_coefficients: ArrayLike,
    position: ArrayLike,
    direction: ArrayLike,
    *,
    leg_error: float = 0.0,
    depth: int = 16,
) -> MotionProof:
    """Prove, interval by interval, that a motion of the legs meets no singularity; or that it does.

    leg_coefficients (N, 5, k + 1): Bernstein coefficients in metres of each leg's reading on each interval (for legs
    linear between setpoints: both setpoints). position, direction (N + 1, 3): the poses at the ends of the intervals,
    roughly; they only say which of several poses with the same legs are meant. leg_error: metres by which each actual
    leg may differ from its polynomial at any time: the claim then holds for every such continuous motion. depth: how
    often an interval may be halved before it is given up.

    Raises ArrayError: wrong shapes, coefficients that are not finite, lengths that are not positive, a negative
    leg_error or depth, legs that jump between intervals by more than 2 leg_error.
    """
    coefficients = as_motion(as_floats(leg_coefficients, "leg_coefficients"))
    p, i = as_batch(position, "position", (None, 3)), as_batch(direction, "direction", (None, 3))
    _check(machine, coefficients, p, i, leg_error, depth)
    n = len(coefficients)
    if n == 0:
        nothing = np.zeros(0, dtype=bool)
        return MotionProof(nothing, nothing, p.copy(), i.copy(), *(np.ones(0) for _ in range(4)))
    scale, out = length_scale(machine), np.full((4, n), np.nan)
    ends = np.concatenate([coefficients[:, :, 0], coefficients[-1:, :, -1]]).T - machine.zeros[:, None]
    with np.errstate(all="ignore"):
        route = _Motion(machine, np.moveaxis(coefficients, 0, -1), leg_error)
        nodes_p, nodes_i, settled = newton(p.T, i.T, mids(route.legs(Ball.exact(ends))), scale)
        nodes_p[:, ~settled] = nodes_i[:, ~settled] = np.nan
        for block in blocks(n, 2048):
            after = slice(block.start + 1, block.stop + 1)
            part = _Motion(machine, np.moveaxis(coefficients[block], 0, -1), leg_error)
            found = continue_poses(
                part,
                (nodes_p[:, block], nodes_i[:, block]),
                scale,
                end=(nodes_p[:, after], nodes_i[:, after]),
                options=ContinuationOptions(2.0**-depth),
            )
            out[:2, block] = found.reached, np.minimum(found.reached + found.step, 1.0)
            out[2:, block] = np.where(found.reached > 0.0, found.sensitivity, np.inf)
        refuted = np.zeros(n, dtype=bool)
        doubt = np.flatnonzero(out[0] < 1.0)
        for block in blocks(len(doubt), 2048):
            some = doubt[block]
            before, after = (
                proven_jacobian_signs((nodes_p[:, k], nodes_i[:, k]), route.legs(legs[:, some]), route.slack, scale)
                for k, legs in ((some, route.coefficients[0]), (some + 1, route.coefficients[-1]))
            )
            refuted[some] = before * after < 0
    return MotionProof(out[0] == 1.0, refuted, nodes_p.T.copy(), nodes_i.T.copy(), *out)


MOTION_MEASURES = (
    ProvenMeasure(
        "",
        "mm/mm",
        1.0,
        "least change of some leg for each mm that the platform shifts along an axis,",
        "by Krawczyk's operator on the leg equations, in ball arithmetic",
    ),
)
"""What `motion_in_branch` bounds: the reciprocal of the sensitivity."""


def motion_in_branch(
    machine: BuiltLegs, leg_coefficients: Floats, position: Floats, direction: Floats, leg_error: float
) -> BranchProof:
    """Return `certify_motion` between poses (N + 1, 3) of one branch as proof that a motion stays in this branch.

    Intervals on which a leg's length is not positive are undecided, and so are all where a pose is missing.
    """
    n = len(leg_coefficients)
    lengths = leg_coefficients - machine.zeros[:, None]
    if not (lengths > 0.0).all():
        nothing = np.zeros(n, dtype=np.bool_)
        return BranchProof(nothing, nothing, np.tile([0.0, 1.0], (n, 1)), np.zeros((n, 1)))
    proven, least = _short_motions(machine, lengths, position, direction, leg_error)
    refuted, doubt = np.zeros(n, dtype=np.bool_), np.full((n, 2), np.nan)
    for run in _runs(~proven):
        nodes = slice(run.start, run.stop + 1)
        proof = certify_motion(machine, leg_coefficients[run], position[nodes], direction[nodes], leg_error=leg_error)
        proven[run], refuted[run] = proof.proven, proof.refuted
        doubt[run] = np.where(proof.proven[:, None], np.nan, np.stack([proof.reached, proof.stop], axis=1))
        with np.errstate(divide="ignore"):
            least[run] = np.where(proof.proven, 1.0 / proof.position_sensitivity, 0.0)
    return BranchProof(proven, refuted, doubt, least[:, None])


def _short_motions(
    machine: BuiltLegs, lengths: Floats, position: Floats, direction: Floats, leg_error: float
) -> tuple[Bools, Floats]:
    """Return which intervals the kernel proves (N,), and the reciprocal of the sensitivity there, 0 elsewhere."""
    from pentapod.kinematics.proofs.motion_kernels import motions  # noqa: PLC0415 - loads numba

    if lengths.shape[-1] < 2:
        return np.zeros(len(lengths), dtype=np.bool_), np.zeros(len(lengths))
    proven, sensitivity = np.zeros(len(lengths), dtype=np.bool_), np.empty(len(lengths))
    motions(
        np.ascontiguousarray(lengths),
        np.concatenate([position, direction], axis=1),
        kernel_geometry(machine, lengths),
        kernel_rings(machine),
        leg_error,
        length_scale(machine),
        kernel_bases(lengths.shape[-1] - 1),
        proven,
        sensitivity,
    )
    with np.errstate(divide="ignore"):
        return proven, np.where(proven, 1.0 / sensitivity, 0.0)


def _runs(doubt: Bools) -> list[slice]:
    """Return where consecutive intervals (N,) are in doubt."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], doubt, [False]]).astype(np.int8)))
    return [slice(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


class _Motion:
    """The legs of a machine on intervals, from Bernstein coefficients (5, k + 1, N) of their readings."""

    def __init__(self, machine: BuiltLegs, coefficients: Floats, leg_error: float) -> None:
        self.base = Ball.exact(machine.base_joints.T[..., None])
        self.offsets, self.radii = Ball.exact(machine.offsets[:, None]), Ball.exact(machine.radii[:, None])
        self.rings = (machine.radii != 0.0)[:, None]
        readings = np.moveaxis(coefficients, 1, 0)  # (k + 1, 5, N)
        self.coefficients = Ball.exact(readings) - machine.zeros[:, None]
        self.degree = len(readings) - 1
        self.slack = np.full((5, 1), leg_error)

    def legs(self, lengths: Ball) -> Legs[Ball]:
        """Return the machine with these lengths (5, N)."""
        return Legs(self.base, self.offsets, self.radii, lengths, self.rings)

    def at(self, which: Ints, s: Floats) -> Legs[Ball]:
        """Return the legs at s."""
        return self.legs(blossom(self.coefficients[:, :, which], [s] * self.degree))

    def over(self, which: Ints, s: Floats, h: Floats) -> LegFamily:
        """Return the legs from s to s + h: the polynomials' coefficients there are their blossom's values."""
        c, k = self.coefficients[:, :, which], self.degree
        if not (s == 0.0).all() or not (h == 1.0).all():
            c = restricted(c, s, h)
        slopes = [(c[j + 1] - c[j]) * float(k) for j in range(k)] or [c[0] * 0.0]
        zero = Ball.exact(np.zeros((1, 1)))
        slope = Legs(zero[None] * np.zeros((3, 1, 1)), zero, zero, hull(stack(slopes)), self.rings)
        middle = self.legs(blossom(c, [np.full(len(s), 0.5)] * k))
        return LegFamily(middle, self.legs(hull(c)), slope, self.slack)


def _check(machine: BuiltLegs, c: Floats, p: Floats, i: Floats, leg_error: float, depth: int) -> None:
    for name, array in (("position", p), ("direction", i)):
        if array.shape != (len(c) + 1, 3):
            expected = f"shape ({len(c) + 1}, 3): the poses at the ends of {len(c)} intervals"
            raise ArrayError(f"{name} has shape {array.shape}", expected=expected)
    if not (np.isfinite(leg_error) and leg_error >= 0.0 and 0 <= depth <= 40):
        raise ArrayError("leg_error must not be negative, nor depth beyond 0 to 40", value=(leg_error, depth))
    if not (c - machine.zeros[:, None] > 0.0).all():
        raise ArrayError("leg_coefficients must be positive lengths", value=float(c.min()), expected="metres")
    if len(c) > 1:
        jumps = np.abs(c[1:, :, 0] - c[:-1, :, -1]).max(axis=1)
        worst = int(np.argmax(jumps))
        if jumps[worst] > 2.0 * leg_error:
            raise ArrayError(
                f"the legs jump between interval {worst} and the next",
                value=float(jumps[worst]),
                expected="intervals that join, to within 2 leg_error",
                remedy="a leg_error of half the jump covers every continuous motion in between",
            )
