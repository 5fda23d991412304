"""Proofs that every family shares, as methods: chords and enclosures of poses by the leg equations."""

from __future__ import annotations

from typing import cast

from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats
from pentapod.kinematics.answers import BranchProof, Chords
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
        self, leg_coefficients: Floats, start: Pose, end: Pose, branch: ArrayLike, *, arms: Floats, towards: Floats
    ) -> Chords:
        """Return what `prove_chords` says of a motion beside its chords."""
        return prove_chords(cast("PosedLegs", self), leg_coefficients, start, end, branch, arms=arms, towards=towards)

    def enclose(self, ends: Pose, readings: Floats, heights: Floats) -> tuple[Floats, Floats]:
        """Return how far points of the line get, and how far the direction: `pose_enclosure`."""
        return pose_enclosure(cast("PosedLegs", self), *ends, readings, heights)
