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
    """The gap between two bars, legs or passive limb. thickness: sum of their radii, metres.

    side: see `signed_leg_clearance`. arms: which of the two end beside the line, and the side on which the other one
    passes their arms.
    """

    first: int
    second: int
    side: float
    thickness: float
    arms: tuple[tuple[int, float], ...] = ()

    @classmethod
    def of(cls, scene: Scene) -> list[LegPairClearance]:
        """Return all pairs; each must pass on the side on which it does in the middle of the work volume."""
        machine = scene.machine
        direction = np.array([0.0, 0.0, float(scene.branch.w)])
        position = machine.work.centre - machine.tool_length * direction
        bars = machine.bars
        base, ends = bars.ends(position, direction)
        legs, beside, radii = ends - base, bars.beside, bars.radii
        found: list[LegPairClearance] = []
        for j, k in combinations(range(len(legs)), 2):
            side = float(np.sign(np.dot(base[k] - base[j], np.cross(legs[j], legs[k]))))
            arms: list[tuple[int, float]] = []
            for arm, leg in ((j, k), (k, j)):
                if beside[arm]:
                    along = position + bars.offsets[arm] * direction - ends[arm]
                    arm_side = np.sign(np.dot(ends[arm] - base[leg], np.cross(legs[leg], along)))
                    arms.append((arm, float(arm_side)))
            legs_only = k < machine.robot.n_legs
            both = f"legs {j + 1} and {k + 1}" if legs_only else f"{bars.names[j]} and {bars.names[k]}"
            found.append(
                cls(
                    name=f"{both} touch", comfort=scene.comforts.legs,
                    first=j, second=k, side=side, thickness=float(radii[j] + radii[k]),
                    arms=tuple(arms),
                )
            )  # fmt: skip
        return found

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin of the gap."""
        j, k = self.first, self.second
        first, second = (pose.bases[j], pose.bases[k]) if pose.machine.limb is None else (pose.base(j), pose.base(k))
        offset = [b - a for a, b in zip(first, second, strict=True)]
        gap = signed_leg_clearance(offset, pose.vectors[j], pose.vectors[k], self.side, pose.xp)
        for arm, arm_side in self.arms:
            leg = k if arm == j else j
            offset = [b - a for a, b in zip(pose.base(leg), pose.joint(arm), strict=True)]
            beside = signed_leg_clearance(offset, pose.vectors[leg], pose.arm(arm), arm_side, pose.xp)
            gap = pose.xp.least(gap, beside)
        return (gap - self.thickness) / self.comfort
