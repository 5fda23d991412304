"""Bars: what stands between base and platform, the legs and the passive limb of a 5-UPS+PRPU robot, as bodies."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from pentapod.base.arrays import Bools, Floats, frozen, set_frozen
from pentapod.base.errors import MachineError
from pentapod.base.values import Value
from pentapod.geometry.directions import angle_between
from pentapod.kinematics.arithmetic import Vector, dot
from pentapod.kinematics.robot import Robot


@dataclass(frozen=True, eq=False)
class PassiveLimb(Value):
    """A carriage on a rail at the base, a strut that turns about the rail and slides, and a universal joint.

    The strut leaves the rail at a right angle and ends on the tool axis, in a universal joint whose first axis is
    parallel to the rail. So the limb follows from the pose: its foot is the point of the rail nearest to that joint.
    rail (3,): direction of the rail, unit; origin (3,): its point where the carriage is at 0, metres. joint: offset of
    the universal joint along the platform line, metres. carriage, strut (2,): least and greatest position on the rail,
    and length of the strut, metres. joint_range (2,): least and greatest angle between strut (seen from its joint) and
    tool axis, radians. radius: of the strut, a capsule, metres.

    Raises MachineError: a range that is empty, a strut that can have no length, no radius.
    """

    rail: Floats
    origin: Floats
    joint: float
    carriage: Floats
    strut: Floats
    joint_range: Floats
    radius: float
    name = "passive limb"

    def __post_init__(self) -> None:
        shapes = {"rail": (3,), "origin": (3,), "carriage": (2,), "strut": (2,), "joint_range": (2,)}
        set_frozen(self, **{name: frozen(getattr(self, name), name, shape) for name, shape in shapes.items()})
        for name, least in (("carriage", -np.inf), ("strut", 0.0), ("joint_range", 0.0)):
            low, high = getattr(self, name)
            if not least <= low < high < np.inf or (name == "strut" and low == 0.0):
                kind = "two positive lengths" if name == "strut" else "two values"
                raise MachineError(
                    "not a range", key=name, value=[float(low), float(high)], expected=f"{kind}, the first the smaller"
                )
        if not self.radius > 0.0:
            raise MachineError("must be positive", key="radius", value=self.radius)

    def numbers(self) -> Iterator[tuple[str, object]]:
        """Yield names and values of all numbers, for digests."""
        yield from ((f"limb.{item.name}", getattr(self, item.name)) for item in fields(self))

    def end_of(self, position: Vector, direction: Vector) -> Vector:
        """Return the universal joint in a pose, three components, by one formula for numbers and symbols."""
        return [position[k] + self.joint * direction[k] for k in range(3)]

    def place_of(self, end: Vector) -> Any:
        """Return the position of the carriage on the rail, metres from `origin`."""
        return dot([end[k] - float(self.origin[k]) for k in range(3)], self.rail.tolist())

    def foot_of(self, end: Vector) -> Vector:
        """Return where the strut stands on the rail."""
        place = self.place_of(end)
        return [float(self.origin[k]) + place * float(self.rail[k]) for k in range(3)]

    def ends(self, position: Floats, direction: Floats) -> tuple[Floats, Floats]:
        """Return both ends (..., 3) of the strut, rail and universal joint, in poses (..., 3)."""
        end = position + self.joint * direction
        return self.origin + ((end - self.origin) @ self.rail)[..., None] * self.rail, end

    def room(self, position: Floats, direction: Floats) -> Floats:
        """Return what is left (..., 6) to the ends of rail and strut, metres, and of the joint's range, radians.

        Each least and greatest; negative beyond.
        """
        ways = np.moveaxis(self.at(position, direction), -1, 0)
        ranges = (self.carriage, self.strut, self.joint_range)
        return np.stack([x for at, (a, b) in zip(ways, ranges, strict=True) for x in (at - a, b - at)], axis=-1)

    def at(self, position: Floats, direction: Floats) -> Floats:
        """Return (..., 3): the carriage's position and the strut's length, metres, the joint's angle, radians."""
        foot, end = self.ends(position, direction)
        place, length = (foot - self.origin) @ self.rail, np.linalg.norm(end - foot, axis=-1)
        return np.stack([place, length, angle_between(foot - end, -direction)], axis=-1)

    def rail_ends(self) -> Floats:
        """Return the ends (2, 3) of the rail, metres."""
        return self.origin + self.carriage[:, None] * self.rail


@dataclass(frozen=True, eq=False)
class Bars:
    """The bars of a robot: legs first, in their order, then the passive limb.

    leg_radius: metres. offsets (B,): of the ends along the platform line, of bars beside it those of their arms' feet,
    metres. beside (B,): which end beside the line. radii (B,): metres.
    """

    robot: Robot
    limb: PassiveLimb | None
    leg_radius: float

    @property
    def names(self) -> tuple[str, ...]:
        """Their names: "leg 1" ..., "passive limb"."""
        legs = tuple(f"leg {k + 1}" for k in range(self.robot.n_legs))
        return legs if self.limb is None else (*legs, self.limb.name)

    @property
    def offsets(self) -> Floats:
        """Where they, or their arms, meet the platform line (B,), metres."""
        return self.robot.offsets if self.limb is None else np.append(self.robot.offsets, self.limb.joint)

    @property
    def beside(self) -> Bools:
        """Which of them end beside the platform line (B,)."""
        legs = self.robot.arms > 0.0
        return legs if self.limb is None else np.append(legs, False)

    @property
    def radii(self) -> Floats:
        """Their radii (B,), metres."""
        legs = np.full(self.robot.n_legs, self.leg_radius)
        return legs if self.limb is None else np.append(legs, self.limb.radius)

    def ends(self, position: Floats, direction: Floats) -> tuple[Floats, Floats]:
        """Return where they begin at the base and end at the platform, (..., B, 3), in poses (..., 3)."""
        robot = self.robot
        joints = robot.platform_joints(position, direction)
        base = np.broadcast_to(robot.base_joints, joints.shape)
        if self.limb is None:
            return base, joints
        foot, end = self.limb.ends(position, direction)
        return np.concatenate([base, foot[..., None, :]], axis=-2), np.concatenate([joints, end[..., None, :]], axis=-2)
