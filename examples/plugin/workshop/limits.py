"""Two limits: of the time law, while new drives run in; of placements, to keep the tool above a table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pentapod import Machine
from pentapod.planning.limits.limit import LengthLimit, LimitKind, Scene
from pentapod.planning.limits.tool_pose import ToolPose
from pentapod.timing.limits.leg_velocity import LegVelocity
from pentapod.timing.limits.limit import Reserve

SHARE = 0.57
TABLE_M, COMFORT_M = 0.9, 0.05


@dataclass(frozen=True, eq=False)
class RunningIn(LegVelocity):
    """Legs move at little more than half their greatest velocity."""

    quantity = "leg velocity while running in"

    @classmethod
    def of(cls, machine: Machine, reserve: Reserve) -> RunningIn:
        """Return the limit for a machine."""
        return cls(SHARE * machine.legs.max_velocity * reserve.slower, SHARE * machine.legs.max_velocity)


@dataclass(frozen=True, kw_only=True)
class AboveTable(LengthLimit):
    """The tool's tip stays nearer to the base plane than a table, `TABLE_M` away from it."""

    @classmethod
    def of(cls, scene: Scene) -> list[AboveTable]:
        """Return the limit; it is the same for all machines."""
        del scene
        return [cls(name="tool tip in the table", comfort=COMFORT_M)]

    def margin(self, pose: ToolPose) -> Any:
        """Return the distance that is left, over the comfortable one."""
        return (TABLE_M - pose.tip[2]) / self.comfort


ABOVE_TABLE = LimitKind(AboveTable.of)
