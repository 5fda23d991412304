"""Leg and spindle: the gap between each leg and the spindle on its own platform line."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.machine.clearance.collision_world import spindle_ends
from pentapod.machine.clearance.segments import signed_leg_clearance
from pentapod.machine.clearance.tool_clearance import leg_spindle_gap
from pentapod.planning.limits.limit import LengthLimit, Scene
from pentapod.planning.limits.tool_pose import ToolPose


@dataclass(frozen=True, kw_only=True)
class LegSpindleClearance(LengthLimit):
    """The gap between one bar and the spindle. side: of a leg beside the line, see `signed_leg_clearance`."""

    leg: int
    side: float = 0.0

    @classmethod
    def of(cls, scene: Scene) -> list[LegSpindleClearance]:
        """Return the gaps of all legs."""
        return [
            cls(name=f"{name} touches the spindle", leg=k, comfort=scene.comforts.tool, side=side_of(scene, k))
            for k, name in enumerate(scene.machine.bars.names)
        ]

    def margin(self, pose: ToolPose) -> Any:
        """Return the margin of the gap."""
        machine, leg = pose.machine, self.leg
        if not machine.bars.beside[leg]:
            return leg_spindle_gap(machine, leg, pose.cosines[leg], pose.xp) / self.comfort
        top, nose = spindle_ends(machine)
        gap = beside_line(pose, leg, machine.tool_length - nose, machine.tool_length - top, self.side)
        return (gap - machine.bodies.shaft_radius - machine.bodies.leg_radius) / self.comfort


def side_of(scene: Scene, leg: int) -> float:
    """Return on which side a leg passes the line in the middle of the work volume; 0 for a leg that ends on it."""
    machine = scene.machine
    robot = machine.robot
    if not machine.bars.beside[leg]:
        return 0.0
    direction = np.array([0.0, 0.0, float(scene.branch.w)])
    position = machine.work.centre - machine.tool_length * direction
    vector = robot.leg_vectors(position, direction)[leg]
    return float(np.sign(np.dot(position - robot.base_joints[leg], np.cross(vector, direction))))


def beside_line(pose: ToolPose, leg: int, low: float, high: float, side: float) -> Any:
    """Return the distance, axis to axis, of a leg from the tool axis between two heights over the tip, metres.

    side: of `side_of`.
    """
    start = [pose.tip[k] + high * pose.axis[k] for k in range(3)]
    along = [(high - low) * pose.direction[k] for k in range(3)]
    offset = [b - a for a, b in zip(pose.base(leg), start, strict=True)]
    return signed_leg_clearance(offset, pose.vectors[leg], along, side, pose.xp)
