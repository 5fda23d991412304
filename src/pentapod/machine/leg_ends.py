"""End points of the legs, of their arms and of the platform line in a pose of the tool, and the base, for drawings."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.directions import tangent_frame
from pentapod.kinematics.legs_on_rings import LegsOnRings
from pentapod.machine.machine import Machine

RIM_SHARE = 1.12
"""Radius of the drawn base, as a share of that of the base joints."""


def leg_ends(machine: Machine, tips: Floats, axes: Floats) -> tuple[Floats, Floats]:
    """Return base joints (n_legs, 3) and platform joints (..., n_legs, 3), metres, of tips and tool axes (..., 3)."""
    robot = machine.robot
    vectors = robot.leg_vectors(tips + machine.tool_length * axes, -axes)
    return robot.base_joints, robot.base_joints + vectors


def arms_beside(machine: Machine) -> tuple[Ints, Floats]:
    """Return which legs (m,) end outside the spindle, on an arm or a ring, and how far above the tip (m,), metres."""
    robot = machine.robot
    beside = robot.radii > machine.bodies.shaft_radius if isinstance(robot, LegsOnRings) else robot.arms > 0.0
    legs = np.flatnonzero(beside)
    return legs, machine.tool_length - robot.offsets[legs]


def strut_ends(machine: Machine, tip: Floats, axis: Floats) -> Floats:
    """Return both ends of the passive limb's strut, (1, 2, 3), metres; (0, 2, 3) where there is none."""
    if machine.limb is None:
        return np.zeros((0, 2, 3))
    return np.stack(machine.limb.ends(tip + machine.tool_length * axis, -axis))[None]


def rails(machine: Machine) -> Floats:
    """Return both ends of the passive limb's rail, (1, 2, 3), metres; (0, 2, 3) where there is none."""
    return np.zeros((0, 2, 3)) if machine.limb is None else machine.limb.rail_ends()[None]


def line_top(machine: Machine, tip: Floats, axis: Floats) -> Floats:
    """Return the far end (3,) of the platform line: the platform joint farthest from the tip, metres."""
    return tip + (machine.tool_length - machine.line_top) * axis


def base_rim(machine: Machine, count: int) -> Floats:
    """Return points (count, 3) of a closed circle around the base joints, in their mean plane; metres."""
    base = machine.robot.base_joints
    centre = base.mean(axis=0)
    normal = np.linalg.svd(base - centre)[2][2]
    first, second = tangent_frame(normal)
    turn = np.linspace(0.0, 2.0 * np.pi, count)[:, None]
    radius = RIM_SHARE * float(np.linalg.norm(base - centre, axis=1).max())
    return centre + radius * (np.cos(turn) * first + np.sin(turn) * second)
