"""Poses that are continued from home, each step of the way with proof, in microseconds."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.kinematics.legs_on_rings import LegsOnRings
from pentapod.kinematics.proofs.chords import kernel_bases, kernel_geometry
from pentapod.kinematics.tubes.leg_equations import length_scale

Pose = tuple[Floats, Floats]
SHORTEST = 2.0**-14
"""Step of a continuation, as a share of its way, below which it is given up: a singularity is near."""


def poses_from_home(robot: LegsOnRings, home: Pose, readings: Floats) -> Pose:
    """Return positions and directions (N, 3) of readings (N, 5): where home gets without a singularity, proven.

    A row is continued on a straight line of the readings from the row before it, or else from home. NaN where nothing
    is proven, where a number is missing, and where a reading is no longer than its zero.
    """
    from pentapod.kinematics.proofs.motion_kernels import continued_poses  # noqa: PLC0415 - loads numba

    poses = np.full((len(readings), 6), np.nan)
    known = np.flatnonzero(np.isfinite(readings).all(axis=1) & (readings > robot.zeros).all(axis=1))
    if len(known):
        lengths, found = readings[known] - robot.zeros, np.empty((len(known), 6))
        at_home = robot.leg_lengths(*home) - robot.zeros
        rings = np.column_stack([np.zeros((5, 8)), robot.radii])
        continued_poses(
            lengths, at_home, np.concatenate(home), kernel_geometry(robot, np.vstack([at_home, lengths])), rings,
            length_scale(robot), kernel_bases(1), SHORTEST, found,
        )  # fmt: skip
        poses[known] = found
    return poses[:, :3], poses[:, 3:]
