"""Machine: a robot that was built. Geometry, limits and bodies, all in SI units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from pentapod.arrays import Floats, frozen, set_frozen
from pentapod.errors import MachineError
from pentapod.kinematics.pentapod import LinearPentapod

Interpolation = Literal["linear", "cubic"]


@dataclass(frozen=True, eq=False)
class LegLimits:
    """Limits of each leg, arrays (5,): lengths in m, rates in m/s, accelerations in m/s², jerks in m/s³."""

    min_length: Floats
    max_length: Floats
    max_velocity: Floats
    max_acceleration: Floats
    max_jerk: Floats

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = frozen(np.broadcast_to(getattr(self, name), (5,)), name, (5,))
            if (value <= 0.0).any():
                raise MachineError("must be positive", key=name, value=value.tolist())
            set_frozen(self, **{name: value})
        if (self.min_length >= self.max_length).any():
            leg = int(np.argmax(self.min_length >= self.max_length)) + 1
            raise MachineError(f"leg {leg}: the shortest length is not below the longest", key="min_length")


@dataclass(frozen=True, eq=False)
class JointLimits:
    """Cones within which the joints let the legs move.

    base_axes (5, 3): unit axis of each base joint's cone, machine frame. base_cone (5,): largest angle of the
    leg to that axis, radians. platform_range (5, 2): least and largest angle in radians between the leg
    (from platform joint towards base joint) and the tool axis tip → spindle.
    """

    base_axes: Floats
    base_cone: Floats
    platform_range: Floats

    def __post_init__(self) -> None:
        set_frozen(
            self,
            base_axes=frozen(np.broadcast_to(self.base_axes, (5, 3)), "base_axes", (5, 3)),
            base_cone=frozen(np.broadcast_to(self.base_cone, (5,)), "base_cone", (5,)),
            platform_range=frozen(np.broadcast_to(self.platform_range, (5, 2)), "platform_range", (5, 2)),
        )


@dataclass(frozen=True)
class Bodies:
    """Simple bodies around the legs and the platform line, metres.

    leg_radius: each leg is a capsule from base joint to platform joint. shaft_radius: the platform (spindle)
    is a capsule along the line, from the platform joint farthest from the tip to the tip's holder end,
    `shaft_end` metres short of the tip. Within `joint_radius` of a leg's own platform joint, leg and shaft
    are joined, not colliding.
    """

    leg_radius: float
    shaft_radius: float
    shaft_end: float
    joint_radius: float


@dataclass(frozen=True)
class ControllerSettings:
    """period: seconds between setpoints. interpolation: how the controller moves between them."""

    period: float
    interpolation: Interpolation


@dataclass(frozen=True, eq=False)
class WorkVolume:
    """What the machine is advertised for: a cylinder of tips and a cone of tool axes, machine frame.

    centre (3,) metres; diameter and height (along z) in metres; tilt: largest angle in radians between the
    tool axis and −z (the base normal away from the work).
    """

    centre: Floats
    diameter: float
    height: float
    tilt: float

    def __post_init__(self) -> None:
        set_frozen(self, centre=frozen(self.centre, "centre", (3,)))


@dataclass(frozen=True, eq=False)
class Machine:
    """A robot that was built.

    tool_length: metres from p (the platform line's origin, where offset = 0) along i to the tool tip.
    rapid_velocity: largest tip speed in m/s on rapids.
    digest: short hash of the machine's content, written into programs.
    """

    name: str
    pentapod: LinearPentapod
    legs: LegLimits
    joints: JointLimits
    bodies: Bodies
    tool_length: float
    rapid_velocity: float
    controller: ControllerSettings
    work: WorkVolume
    digest: str
