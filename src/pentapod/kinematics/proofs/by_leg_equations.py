"""Proofs that every family shares, as methods: chords and enclosures of poses by the leg equations."""

from __future__ import annotations

from typing import cast

from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats
from pentapod.kinematics.proof_results import BranchProof, Chords
from pentapod.kinematics.proofs.chords import Pose, prove_chords
from pentapod.kinematics.proofs.motion import MOTION_MEASURES, motion_in_branch
from pentapod.kinematics.proofs.pose_enclosure import pose_enclosure
from pentapod.kinematics.tubes.leg_equations import PosedLegs


class ProvenByLegEquations:
    """A robot whose proofs are by Krawczyk's operator on the leg equations; a family may have a quicker one."""

    proven_measures = MOTION_MEASURES

    def prove(self, leg_coefficients: Floats, ends: Pose, branch: ArrayLike, *, leg_error: float = 0.0) -> BranchProof:
        """Return by `certify_motion` whether a motion stays in the branch, of which the poses at the ends are."""
        return motion_in_branch(cast("PosedLegs", self), leg_coefficients, *ends, leg_error)

    def prove_chords(
        self, legs: Floats, start: Pose, end: Pose, branch: ArrayLike, *, offsets: Floats, base_axes: Floats
    ) -> Chords:
        """Return bounds of deviation and speed beside the chords: `prove_chords`."""
        robot = cast("PosedLegs", self)
        return prove_chords(robot, legs, start, end, branch, offsets=offsets, base_axes=base_axes)

    def enclose(self, poses: Pose, legs: Floats, offsets: Floats) -> tuple[Floats, Floats]:
        """Return bounds of how far points of the line and the direction get: `pose_enclosure`."""
        return pose_enclosure(cast("PosedLegs", self), *poses, legs, offsets)
