"""Leg and spindle: the gap between each leg and the spindle on its own platform line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pentapod.machine.clearance.tool_clearance import leg_spindle_gap
from pentapod.planning.limits.limit import LengthLimit, Scene
from pentapod.planning.limits.tool_pose import ToolPose


@dataclass(frozen=True, kw_only=True)
class LegSpindleClearance(LengthLimit):
    """The gap between one leg and the spindle."""

    leg: int

    @classmethod
    def of(cls, scene: Scene) -> list[LegSpindleClearance]:
        """Return the gaps of all legs."""
        return [
            cls(name=f"leg {k + 1} touches the spindle", leg=k, comfort=scene.comforts.tool)
            for k in range(scene.machine.robot.n_legs)
        ]

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin of the gap."""
        return leg_spindle_gap(pose.machine, self.leg, pose.cosines[self.leg], pose.xp) / self.comfort
