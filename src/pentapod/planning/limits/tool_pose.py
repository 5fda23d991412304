"""ToolPose: a tool pose with the leg vectors, lengths and angles that limits are stated in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from pentapod.kinematics.arithmetic import Arithmetic
from pentapod.machine.machine import Machine

Joints = tuple[Sequence[Sequence[Any]], Sequence[Any]]
"""Base attachments (5) of two and platform offsets (5), metres: numbers or expressions."""


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

    xp: the functions of this arithmetic. joints: where the joints are, if not where the machine has them. contacts:
    with the workpiece and other obstacles, where expressions are asked for.
    """

    machine: Machine
    tip: Sequence[Any]
    axis: Sequence[Any]
    xp: Arithmetic
    joints: Joints | None = None
    contacts: WorkpieceContacts | None = None

    @cached_property
    def position(self) -> list[Any]:
        """The platform line's origin p."""
        return [self.tip[k] + self.machine.tool_length * self.axis[k] for k in range(3)]

    @cached_property
    def direction(self) -> list[Any]:
        """The platform line's direction i, to the tip."""
        return [-self.axis[0], -self.axis[1], -self.axis[2]]

    @cached_property
    def bases(self) -> Sequence[Sequence[Any]]:
        """The base joints (n) of two or three components."""
        return self.machine.robot.base.tolist() if self.joints is None else self.joints[0]

    @cached_property
    def heights(self) -> Sequence[Any]:
        """The platform joints' places (n) along the line."""
        return self.machine.robot.offsets.tolist() if self.joints is None else self.joints[1]

    @cached_property
    def vectors(self) -> list[list[Any]]:
        """The legs (n) from base joint to platform joint, three components each."""
        p, (u, v, w) = self.position, self.direction
        both = zip(self.bases, self.heights, strict=True)
        return [[p[0] + z * u - x, p[1] + z * v - y, p[2] + z * w] for (x, y), z in both]

    @cached_property
    def lengths(self) -> list[Any]:
        """The distances (n) of the joints of each leg, metres."""
        return [self.xp.sqrt(dot(d, d)) for d in self.vectors]

    @cached_property
    def cosines(self) -> list[Any]:
        """The cosines (n) of the angles between legs and tool axis, at the platform joints."""
        return [dot(d, self.direction) / length for d, length in zip(self.vectors, self.lengths, strict=True)]


def dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """Return the scalar product of three components each."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
