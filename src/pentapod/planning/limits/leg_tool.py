"""Leg and tool: the gap between each leg and the shank and holder on its own platform line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pentapod.geometry.solids import Solid
from pentapod.machine.clearance.collision_world import TOOL_BODY
from pentapod.machine.clearance.tool_clearance import leg_tool_gap, widest_stretch
from pentapod.planning.limits.leg_spindle import beside_line, side_of
from pentapod.planning.limits.limit import LengthLimit, Scene
from pentapod.planning.limits.tool_pose import ToolPose


@dataclass(frozen=True, kw_only=True)
class LegToolClearance(LengthLimit):
    """The gap between one bar and the solids of shank and holder. side: see `LegSpindleClearance`."""

    leg: int
    solids: tuple[Solid, ...]
    side: float = 0.0

    @classmethod
    def of(cls, scene: Scene) -> list[LegToolClearance]:
        """Return the gaps of all legs; none for a tool without shank and holder."""
        solids = scene.collision_world.tool
        return [
            cls(
                name=f"{name} touches the {TOOL_BODY}",
                leg=k,
                comfort=scene.comforts.tool,
                solids=solids,
                side=side_of(scene, k),
            )
            for k, name in enumerate(scene.machine.bars.names if solids else ())
        ]

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin of the gap."""
        if pose.machine.bars.beside[self.leg]:
            low, high, radius = widest_stretch(self.solids)
            gap = beside_line(pose, self.leg, low, high, self.side) - radius - pose.machine.bodies.leg_radius
            return gap / self.comfort
        cosine, length = pose.cosines[self.leg], pose.lengths[self.leg]
        return leg_tool_gap(pose.machine, self.solids, self.leg, cosine, length, pose.xp) / self.comfort
