"""ToolPose: a tool pose with the leg vectors, lengths and angles that limits use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pentapod.kinematics.arithmetic import NUMPY, Arithmetic, Joints, Vector, dot
from pentapod.kinematics.robot import Branch, Robot
from pentapod.machine.machine import Machine


@dataclass(frozen=True, eq=False)
class WorkpieceContacts:
    """The workpiece's placement and its contacts with moving bodies, as casadi expressions.

    rotation (3, 3) and translation (3): workpiece → machine. numbers: those of all contacts, one after the other.
    """

    rotation: Any
    translation: Sequence[Any]
    numbers: Sequence[Any]


@dataclass(frozen=True, eq=False)
class ToolPose:
    """Tip and axis (tip → spindle) of the tool, three components each, as NumPy arrays or casadi expressions.

    branch: in which the machine works. xp: the functions of this arithmetic. joints: their positions, if not those of
    the machine. contacts: with the workpiece and other obstacles, for expressions alone.
    """

    machine: Machine
    branch: Branch
    tip: Vector
    axis: Vector
    xp: Arithmetic
    joints: Joints | None = None
    contacts: WorkpieceContacts | None = None

    @cached_property
    def position(self) -> Vector:
        """The platform line's origin p."""
        return [self.tip[k] + self.machine.tool_length * self.axis[k] for k in range(3)]

    @cached_property
    def direction(self) -> Vector:
        """The platform line's direction i, to the tip."""
        return [-self.axis[0], -self.axis[1], -self.axis[2]]

    @cached_property
    def bases(self) -> Sequence[Vector]:
        """Where the bars begin: two coordinates each where all lie in the base plane."""
        bases, limb = joints_of(self.machine.robot)[0] if self.joints is None else self.joints[0], self.machine.limb
        return bases if limb is None else [*bases, limb.foot_of(limb.end_of(self.position, self.direction))]

    @cached_property
    def heights(self) -> Sequence[Any]:
        """The heights of the bars' platform joints along the line."""
        heights, limb = joints_of(self.machine.robot)[1] if self.joints is None else self.joints[1], self.machine.limb
        return heights if limb is None else [*heights, limb.joint]

    @cached_property
    def vectors(self) -> list[Vector]:
        """The bars, legs and then the passive limb, from base to platform."""
        legs = self.machine.robot.vectors_of(self.position, self.direction, self.xp, self.joints)
        if self.machine.limb is None:
            return legs
        end = self.machine.limb.end_of(self.position, self.direction)
        return [*legs, [end[k] - self.bases[-1][k] for k in range(3)]]

    def base(self, leg: int) -> Vector:
        """Return the base joint of a bar, three components."""
        return [*self.bases[leg], 0.0][:3]

    def joint(self, leg: int) -> Vector:
        """Return the platform joint of a bar."""
        base, vector = self.base(leg), self.vectors[leg]
        return [base[k] + vector[k] for k in range(3)]

    def arm(self, leg: int) -> Vector:
        """Return the way from a platform joint beside the line to the foot of its arm on the line."""
        joint, height = self.joint(leg), self.heights[leg]
        return [self.position[k] + height * self.direction[k] - joint[k] for k in range(3)]

    @cached_property
    def readings(self) -> list[Any]:
        """The leg lengths (n_legs) as the controller reads them, metres: with the zeros of the scales."""
        robot = self.machine.robot
        zeros = robot.lengths_of([(0.0, 0.0, 0.0)] * robot.n_legs, NUMPY)
        return [
            length + zero if zero else length for length, zero in zip(self.lengths[: robot.n_legs], zeros, strict=True)
        ]

    @cached_property
    def lengths(self) -> list[Any]:
        """The distances between the joints of each bar, metres."""
        return [self.xp.sqrt(dot(d, d)) for d in self.vectors]

    @cached_property
    def cosines(self) -> list[Any]:
        """The cosines of the angles between bars and line, at the platform joints."""
        return [dot(d, self.direction) / length for d, length in zip(self.vectors, self.lengths, strict=True)]

    @cached_property
    def singularity_margins(self) -> list[Any]:
        """The distances from the robot's singular surfaces, positive on the branch's side."""
        return self.machine.robot.singularity_margins(self.position, self.direction, self.branch, self.xp)


def joints_of(robot: Robot) -> Joints:
    """Return the positions of a robot's joints; without z where the base joints lie in the base plane."""
    base = robot.base_joints
    return (base if np.any(base[:, 2]) else base[:, :2]).tolist(), robot.offsets.tolist()
