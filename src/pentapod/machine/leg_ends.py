"""End points of the legs and of the platform line in a pose of the tool, for drawings."""

from __future__ import annotations

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine


def leg_ends(machine: Machine, tips: Floats, axes: Floats) -> tuple[Floats, Floats]:
    """Return base joints (n_legs, 3) and platform joints (..., n_legs, 3), metres, of tips and tool axes (..., 3)."""
    robot = machine.robot
    vectors = robot.leg_vectors(tips + machine.tool_length * axes, -axes)
    return robot.base_joints, robot.base_joints + vectors


def line_top(machine: Machine, tip: Floats, axis: Floats) -> Floats:
    """Return the far end (3,) of the platform line: the platform joint farthest from the tip, metres."""
    return tip + (machine.tool_length - float(machine.robot.offsets.min())) * axis
