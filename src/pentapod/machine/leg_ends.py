"""Where the legs and the platform line of a machine end in a pose of the tool, for drawings."""

from __future__ import annotations

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine


def leg_ends(machine: Machine, tips: Floats, axes: Floats) -> tuple[Floats, Floats]:
    """Return base joints (n_legs, 3) and platform joints (..., n_legs, 3), metres, of tips and tool axes (..., 3)."""
    robot = machine.robot
    vectors = robot.leg_vectors(tips + machine.tool_length * axes, -axes)
    return robot.base_joints, robot.base_joints + vectors


def line_top(machine: Machine, tip: Floats, axis: Floats) -> Floats:
    """Return the end (3,) of the platform line that is farther from the tip: the highest platform joint, metres."""
    return tip + (machine.tool_length - float(machine.robot.offsets.min())) * axis
