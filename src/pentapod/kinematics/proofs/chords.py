"""Chord errors of a motion of the legs, proven for all times by Krawczyk's operator, for long programs.

Between two samples the legs are polynomials in time, and x̃(t) is the straight line from the one pose to the other.
As in `tip_tube`, Krawczyk's operator proves that there is exactly one pose within a box around x̃(t) at each time; here
with the line in place of a fitted polynomial, and with floating point and an allowance for rounding in place of ball
arithmetic, which takes microseconds for each chord. To first order the motion is x̃ − C G(x̃(t), t). This polynomial is
what the bounds are taken of; like the deviation itself it is of second order in the chord (lemmas 7, 8, 12 and 15 of
docs/proofs.md). The speed follows from the derivative in the same way. Where the proof fails, the chord is halved.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_batch, as_floats, row_lengths
from pentapod.base.errors import ArrayError
from pentapod.kinematics.batches import as_motion
from pentapod.kinematics.component import as_component
from pentapod.kinematics.proof_results import Chords
from pentapod.kinematics.tubes.leg_equations import BuiltLegs, PosedLegs, QuadraticLegs
from pentapod.numerics.bernstein import elevate, multiply, split

Pose = tuple[Floats, Floats]


def prove_chords(
    robot: PosedLegs,
    leg_coefficients: ArrayLike,
    start: Pose,
    end: Pose,
    component: ArrayLike,
    *,
    offsets: ArrayLike,
    base_axes: ArrayLike,
    depth: int = 8,
) -> Chords:
    """Return what can be proven of the motion beside each chord.

    leg_coefficients (H, 5, k + 1): Bernstein coefficients in metres of the legs' readings on the chord, k ≥ 1. start,
    end: positions and directions (H, 3) each, the poses of the component at both ends, to rounding; whatever they are,
    the bounds hold. offsets (A,): of points along the line from p, metres. base_axes (5, 3): unit vectors, machine
    frame, from which the angles of the legs are measured. depth: how often a chord may be halved.
    Raises ArrayError for a wrong shape, numbers that are not finite, signs other than ±1, a negative depth.
    """
    legs = as_motion(as_floats(leg_coefficients, "leg_coefficients"), least=1)
    signs = np.array(as_component(component), dtype=np.float64)
    points = as_floats(offsets, "offsets", (None,))
    if points.ndim != 1:
        raise ArrayError(f"offsets has shape {points.shape}", expected="shape (A,)")
    if depth < 0:
        raise ArrayError("depth must not be negative", value=depth)
    ends: list[Floats] = []
    for name, pose in (("start", start), ("end", end)):
        ends.append(np.concatenate([as_batch(x, name, (3,)) for x in pose], axis=-1))
        if ends[-1].shape != (len(legs), 6):
            raise ArrayError(
                f"{name} has shape {ends[-1].shape}", expected=f"positions and directions ({len(legs)}, 3)"
            )
    prover = _Prover(robot, signs, points, as_floats(base_axes, "base_axes", (5, 3)), legs.shape[-1] - 1)
    return prover.prove(legs - robot.zeros[:, None], ends[0], ends[1], depth)


class _Prover:
    """The robot and the questions, as the kernel takes them."""

    def __init__(self, robot: PosedLegs, signs: Floats, offsets: Floats, base_axes: Floats, degree: int) -> None:
        self.robot, self.signs, self.offsets, self.base_axes = robot, signs, offsets, np.ascontiguousarray(base_axes)
        self.rings = kernel_rings(robot)
        self.bases = kernel_bases(degree)

    def prove(self, legs: Floats, start: Floats, end: Floats, depth: int) -> Chords:
        """As `prove_chords`; start, end (H, 6)."""
        from pentapod.kinematics.krawczyk.chords_kernels import chords  # noqa: PLC0415 - loads numba
        from pentapod.kinematics.krawczyk.lane_kernels import LANES  # noqa: PLC0415

        rings = None if self.rings is None else np.tile(self.rings, (LANES, 1, 1))
        count, points = len(legs), len(self.offsets)
        proven, angles = np.empty(count, dtype=np.bool_), np.empty(count)
        deviations, speeds = np.empty((count, points)), np.empty((count, points))
        found = (proven, deviations, angles, speeds, np.empty((count, 5)), np.empty((count, 5, 2)))
        geometry, asked = kernel_geometry(self.robot, legs), (self.signs, self.offsets, self.base_axes, self.bases)
        chords(np.ascontiguousarray(legs), start, end, geometry, rings, *asked, found)
        answer = Chords(*found)
        if depth > 0:
            self._halve(answer, legs, start, end, depth)
        return answer

    def _halve(self, found: Chords, legs: Floats, start: Floats, end: Floats, depth: int) -> None:
        """Fill in what two halves prove where the whole chord was not proven, or its speed was not."""
        failed = ~found.proven | ~np.isfinite(found.speeds).all(axis=1)
        failed &= np.isfinite(start).all(axis=1) & np.isfinite(end).all(axis=1)
        which = np.flatnonzero(failed)
        if not len(which):
            return
        halves = split(legs[which])
        middle = np.concatenate(self.robot.pose(halves[0][..., -1] + self.robot.zeros, self.signs), axis=-1)
        first, last, half = start[which], end[which], len(which)
        parts = self.prove(
            np.concatenate(halves), np.concatenate([first, middle]), np.concatenate([middle, last]), depth - 1
        )
        off = middle - 0.5 * (first + last)
        aside = row_lengths(off[:, None, :3] + self.offsets[:, None] * off[:, None, 3:])

        def largest(values: Floats) -> Floats:
            return np.maximum(values[:half], values[half:])

        found.proven[which] = parts.proven[:half] & parts.proven[half:]
        found.deviations[which] = largest(parts.deviations) + aside
        # Where the middle of the line between unit vectors is longer than 5/6, an offset turns it by no more than this.
        long_enough = np.linalg.norm(0.5 * (first + last)[:, 3:], axis=1) > 5.0 / 6.0
        turned_aside = np.where(long_enough, 1.2 * np.linalg.norm(off[:, 3:], axis=1), np.inf)
        found.angles[which] = largest(parts.angles) + 1.001 * turned_aside
        found.speeds[which] = 2.0 * largest(parts.speeds)
        found.base_cosines[which] = -largest(-parts.base_cosines)
        found.platform_cosines[which, :, 0] = -largest(-parts.platform_cosines[..., 0])
        found.platform_cosines[which, :, 1] = largest(parts.platform_cosines[..., 1])


def kernel_geometry(robot: BuiltLegs, legs: Floats) -> Floats:
    """Return a robot's numbers (6, 4) as `krawczyk_kernels` take them, for legs of these lengths or NaN."""
    last = [robot.delta, robot.lever, 1.0] if isinstance(robot, QuadraticLegs) else [0.0, 0.0, 0.0]
    longest = float(np.nanmax(np.abs(legs), initial=0.0))
    reach = longest + 2.0 * float(np.abs(robot.base_joints).sum(axis=1).max())
    size = 2.0 * (reach + 2.0 * float(np.abs(robot.offsets).max()) + 4.0 * float(robot.radii.max()))
    rows = np.column_stack([robot.base_joints, robot.offsets])
    return np.vstack([rows, [*last[:2], size, last[2]]])


def kernel_rings(robot: BuiltLegs) -> Floats | None:
    """Return a robot's rings (5, 9) as `krawczyk_kernels` take them; None where it has none."""
    return np.column_stack([np.zeros((5, 8)), robot.radii]) if robot.radii.any() else None


@cache
def kernel_bases(degree: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Return what `chords` of the kernels takes as bases."""
    one, top = np.eye(degree + 1), max(degree, 2)
    return (
        np.array([[multiply(a, b)[m + n] for n, b in enumerate(one)] for m, a in enumerate(one)]),
        _elevation(2, 2 * degree),
        _elevation(1, degree),
        np.ascontiguousarray(np.concatenate([_elevation(2, top), _elevation(degree, top)])),
    )


def _elevation(low: int, high: int) -> Floats:
    """Return the matrix (low + 1, high + 1) whose rows are the basis of degree `low` written with degree `high`."""
    return np.ascontiguousarray(elevate(np.eye(low + 1), high - low))
