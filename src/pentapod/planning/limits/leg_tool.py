"""Leg and tool: the gap between each leg and the shank and holder on its own platform line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pentapod.geometry.solids import Solid
from pentapod.machine.clearance.collision_world import TOOL_BODY
from pentapod.machine.clearance.tool_clearance import leg_tool_gap
from pentapod.planning.limits.limit import LengthLimit, Scene
from pentapod.planning.limits.tool_pose import ToolPose


@dataclass(frozen=True, kw_only=True)
class LegToolClearance(LengthLimit):
    """The gap between one leg and the solids of shank and holder."""

    leg: int
    solids: tuple[Solid, ...]

    @classmethod
    def of(cls, scene: Scene) -> list[LegToolClearance]:
        """Return the gaps of all legs; none for a tool without shank and holder."""
        solids = scene.collision_world.tool
        return [
            cls(name=f"leg {k + 1} touches the {TOOL_BODY}", leg=k, comfort=scene.comforts.tool, solids=solids)
            for k in range(scene.machine.robot.n_legs if solids else 0)
        ]

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin of the gap."""
        cosine, length = pose.cosines[self.leg], pose.lengths[self.leg]
        return leg_tool_gap(pose.machine, self.solids, self.leg, cosine, length, pose.xp) / self.comfort
