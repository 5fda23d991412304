"""Robot: the protocol of parallel robots that hold a tool axis by legs of variable length.

Planning, timing, verification and simulation ask a robot, never a family's own numbers. A *pose* is the position p of
the origin of the platform line and the line's unit direction i, towards the tip; the tip is p + tool_length · i and the
tool axis (tip → spindle) is −i. All lengths are in metres, in the machine frame, and the last axes of arrays are
(n_legs,) or (n_legs, 3).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.kinematics.arithmetic import Arithmetic, Joints, Vector
from pentapod.kinematics.component import Component
from pentapod.kinematics.mode import Mode
from pentapod.kinematics.proof_results import BranchProof, Chords, ProvenMeasure

Branch: TypeAlias = Component | Mode
"""Which of the poses with the same leg lengths is meant: two signs, and `w`, the sign of the direction's z."""


Poses: TypeAlias = tuple[Floats, Floats]
"""Positions and directions (..., 3)."""


@dataclass(frozen=True)
class SingularSurface(Value):
    """A surface of poses that a motion must not cross. name: as a user knows it.

    unit: of the margin: "mm" for a distance by which the platform can shift unturned (values in metres), "deg" for an
    angle by which it can turn (values are the angle's sine).
    """

    name: str
    unit: Literal["mm", "deg"]


class Robot(Protocol):
    """What everything above `kinematics` asks of a robot. Families: see `pentapod.kinematics.families`."""

    @property
    def n_legs(self) -> int:
        """How many legs there are."""
        ...

    @property
    def base_joints(self) -> Floats:
        """The legs' joints on the base (n_legs, 3)."""
        ...

    @property
    def offsets(self) -> Floats:
        """The platform offsets (n_legs,): positions of the platform joints on the line, from p towards the tip."""
        ...

    @property
    def arms(self) -> Floats:
        """The lengths (n_legs,) of the arms on which platform joints stand beside the line; 0 for joints on it.

        An arm is a rigid part of the platform, perpendicular to the line, from the leg's place in `offsets` on.
        """
        ...

    @property
    def branches(self) -> tuple[Branch, ...]:
        """The labels of the branches, of two signs each."""
        ...

    @property
    def singularities(self) -> tuple[SingularSurface, ...]:
        """The surfaces that `singularity_margins` measures from."""
        ...

    @property
    def conditioning(self) -> float:
        """How far the geometry is from being singular in every pose: 0 is singular, above 0.01 is sound."""
        ...

    @property
    def numbers(self) -> Mapping[str, object]:
        """All numbers of the geometry by name, for digests: equal robots have equal numbers."""
        ...

    def branch(self, position: ArrayLike, direction: ArrayLike) -> NDArray[np.int8]:
        """Return the signs (..., 2) of the branches of poses (..., 3); 0 on a singularity and for NaN."""
        ...

    def pose(self, legs: ArrayLike, branch: ArrayLike, /) -> tuple[Floats, Floats]:
        """Return positions and directions (..., 3) of leg readings (..., n_legs) in a branch, signs (..., 2).

        NaN where these readings have no pose in the branch (or none that is proven).
        """
        ...

    def leg_lengths(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return the readings of the legs (..., n_legs) in poses (..., 3): what the controller is sent."""
        ...

    def leg_vectors(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return the vectors (..., n_legs, 3) from the base joints to the platform joints in poses (..., 3)."""
        ...

    def platform_joints(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return where the legs end (..., n_legs, 3) in poses (..., 3)."""
        ...

    def jacobian(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return ∂readings/∂(p, i) (..., n_legs, 6) in poses (..., 3): m/m, then metres per change of i."""
        ...

    def passive_wrenches(self, position: ArrayLike, direction: ArrayLike) -> Floats:
        """Return what passive joints hold (..., c, 6): force, moment about p, machine frame, by unit of each of them.

        Legs and passive joints together hold six freedoms, or five: then the platform is free to turn about its line.
        """
        ...

    def hinges(self, position: ArrayLike, direction: ArrayLike) -> Mapping[int, Floats]:
        """Return the axes (..., 3) of the revolute joints in which legs hang on the platform, by index of the leg.

        The other legs hang in joints that transmit no moment.
        """
        ...

    def leg_derivatives(self, tips: Sequence[tuple[Floats, Floats]], tool_length: float) -> list[Floats]:
        """Return the readings (n, n_legs) and their derivatives along a curve, of as many orders as are given.

        tips: at [k] the derivatives of order k ≤ 3 of the tip and of the tool axis, (n, 3) each.
        """
        ...

    def vectors_of(self, p: Vector, i: Vector, do: Arithmetic, joints: Joints | None = None) -> list[Vector]:
        """Return `leg_vectors`, one for each leg, by a formula for numbers and symbols alike.

        joints: where they are, if not where the robot has them.
        """
        ...

    def lengths_of(self, vectors: Sequence[Vector], do: Arithmetic) -> list[Any]:
        """Return the readings of legs along vectors from `vectors_of`."""
        ...

    def singularity_margins(self, p: Vector, i: Vector, branch: Branch, do: Arithmetic) -> list[Any]:
        """Return how far a pose is on the branch's side of each of `singularities`: positive on its side."""
        ...

    @property
    def proven_measures(self) -> tuple[ProvenMeasure, ...]:
        """What `prove` bounds from below."""
        ...

    def prove(self, leg_coefficients: Floats, ends: Poses, branch: ArrayLike, *, leg_error: float = 0.0) -> BranchProof:
        """Prove, interval by interval, that a motion of the legs stays in a branch.

        leg_coefficients (N, n_legs, k + 1): Bernstein coefficients of the readings on each interval. ends: the poses
        (N + 1, 3) of the branch between the intervals. leg_error: by how much each leg may be off at any time.
        """
        ...

    def prove_chords(
        self, legs: Floats, start: Poses, end: Poses, branch: ArrayLike, *, offsets: Floats, base_axes: Floats
    ) -> Chords:
        """Return bounds of a motion's deviation from the straight lines between poses, and of its speed: `Chords`."""
        ...

    def enclose(self, poses: Poses, legs: Floats, offsets: Floats) -> tuple[Floats, Floats]:
        """Return bounds of how far points of the line (N, K) and the direction (N,) get from where they are in N poses.

        legs (N, M, n_legs): readings in whose convex hull those of the legs are at all times. offsets (K,): of the
        points along the line from p. Infinite where nothing is proven.
        """
        ...

    def enclose_joints(self, poses: Poses, legs: Floats) -> Floats:
        """Return bounds (N, n_legs) of how far the platform joints get from where they are in N poses, as `enclose`."""
        ...


def own_branch(robot: Robot, branch: Branch) -> Branch:
    """Return a robot's label of a branch that comes from a file: two signs, which say of which z the direction is.

    Where the robot has no branch of these signs it is returned as it is.
    """
    return next((own for own in robot.branches if tuple(own) == tuple(branch)), branch)
