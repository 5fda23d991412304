"""Leg pairs: signed clearance of two legs, negative where they have passed through each other."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from pentapod.machine.clearance.segments import signed_leg_clearance
from pentapod.planning.limits.limit import LengthLimit, Scene
from pentapod.planning.limits.tool_pose import ToolPose


@dataclass(frozen=True, kw_only=True)
class LegPairClearance(LengthLimit):
    """The gap between two legs. thickness: of a leg, metres; side: see `signed_leg_clearance`."""

    first: int
    second: int
    side: float
    thickness: float
    arm: int | None = None
    arm_side: float = 0.0

    @classmethod
    def of(cls, scene: Scene) -> list[LegPairClearance]:
        """Return all pairs; each must pass on the side on which it does in the middle of the work volume."""
        machine = scene.machine
        direction = np.array([0.0, 0.0, float(scene.branch.w)])
        position = machine.work.centre - machine.tool_length * direction
        robot = machine.robot
        legs, base, arms = robot.leg_vectors(position, direction), robot.base_joints, robot.arms
        found: list[LegPairClearance] = []
        for j, k in combinations(range(len(legs)), 2):
            side = float(np.sign(np.dot(base[k] - base[j], np.cross(legs[j], legs[k]))))
            arm, arm_side = None, 0.0
            if (arms[j] > 0.0) != (arms[k] > 0.0):
                arm, leg = (j, k) if arms[j] > 0.0 else (k, j)
                joint = base[arm] + legs[arm]
                along = position + robot.offsets[arm] * direction - joint
                arm_side = float(np.sign(np.dot(joint - base[leg], np.cross(legs[leg], along))))
            found.append(
                cls(
                    name=f"legs {j + 1} and {k + 1} touch", comfort=scene.comforts.legs,
                    first=j, second=k, side=side, thickness=2.0 * machine.bodies.leg_radius,
                    arm=arm, arm_side=arm_side,
                )
            )  # fmt: skip
        return found

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin of the gap."""
        j, k = self.first, self.second
        offset = [b - a for a, b in zip(pose.bases[j], pose.bases[k], strict=True)]
        gap = signed_leg_clearance(offset, pose.vectors[j], pose.vectors[k], self.side, pose.xp)
        if self.arm is not None:
            leg = k if self.arm == j else j
            offset = [b - a for a, b in zip(pose.base(leg), pose.joint(self.arm), strict=True)]
            beside = signed_leg_clearance(offset, pose.vectors[leg], pose.arm(self.arm), self.arm_side, pose.xp)
            gap = pose.xp.least(gap, beside)
        return (gap - self.thickness) / self.comfort
