"""The parts of a machine beside its geometry: limits of legs and joints, bodies, controller, advertised work."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import MachineError
from pentapod.base.values import Value
from pentapod.machine.fields import per_leg, positive

Interpolation = Literal["linear", "cubic"]


@dataclass(frozen=True, eq=False)
class LegLimits(Value):
    """Limits of each leg, arrays (5,): lengths in m, rates in m/s, accelerations in m/s², jerks in m/s³.

    Scalars hold for all legs. Raises MachineError: not positive and finite, min_length ≥ max_length.
    """

    min_length: Floats
    max_length: Floats
    max_velocity: Floats
    max_acceleration: Floats
    max_jerk: Floats

    def __post_init__(self) -> None:
        per_leg(self, *self.__dataclass_fields__)
        positive(self, *self.__dataclass_fields__)
        if (self.min_length >= self.max_length).any():
            leg = int(np.argmax(self.min_length >= self.max_length))
            raise MachineError(
                f"leg {leg + 1}: the shortest length is not below the longest",
                key="min_length",
                value=float(self.min_length[leg]),
                expected=f"less than max_length, {self.max_length[leg]:g} m",
            )

    @property
    def stroke(self) -> Floats:
        """max_length − min_length, (5,) metres."""
        return self.max_length - self.min_length


@dataclass(frozen=True, eq=False)
class JointLimits(Value):
    """Cones within which the joints let the legs move.

    base_axes (5, 3): unit axis of each base joint's cone, machine frame. base_cone (5,): largest angle of the
    leg to that axis, radians. platform_range (5, 2): least and largest angle in radians between the leg
    (from platform joint towards base joint) and the tool axis tip → spindle.

    Raises MachineError: axes that are not unit to 1e-3 (they are then normalised), a cone beyond 90°, a range
    that is empty or beyond 0..180°.
    """

    base_axes: Floats
    base_cone: Floats
    platform_range: Floats

    def __post_init__(self) -> None:
        per_leg(self, "base_cone")
        positive(self, "base_cone")
        axes = frozen(np.broadcast_to(self.base_axes, (5, 3)), "base_axes", (5, 3))
        norms = np.linalg.norm(axes, axis=1, keepdims=True)
        if (np.abs(norms - 1.0) > 1e-3).any():
            leg = int(np.argmax(np.abs(norms - 1.0)))
            raise MachineError(f"leg {leg + 1}: not a unit vector", key="base_axes", value=axes[leg].tolist())
        limits = frozen(np.broadcast_to(self.platform_range, (5, 2)), "platform_range", (5, 2))
        if (self.base_cone > 0.5 * np.pi).any():
            raise MachineError("beyond 90 degrees", key="base_cone", value=np.degrees(self.base_cone).tolist())
        if (limits[:, 0] < 0.0).any() or (limits[:, 1] > np.pi).any() or (limits[:, 0] >= limits[:, 1]).any():
            value = np.degrees(limits).tolist()
            raise MachineError("not a range", key="platform_range", value=value, expected="0 ≤ min < max ≤ 180 degrees")
        set_frozen(self, base_axes=frozen(axes / norms, "base_axes"), platform_range=limits)


@dataclass(frozen=True)
class Bodies(Value):
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

    def __post_init__(self) -> None:
        positive(self, *self.__dataclass_fields__)


@dataclass(frozen=True)
class ControllerSettings(Value):
    """period: seconds between setpoints. interpolation: how the controller moves between them."""

    period: float
    interpolation: Interpolation

    def __post_init__(self) -> None:
        positive(self, "period")
        if self.interpolation not in get_args(Interpolation):
            raise MachineError(
                "unknown interpolation",
                key="interpolation",
                value=self.interpolation,
                expected='"linear" or "cubic"',
            )


@dataclass(frozen=True, eq=False)
class WorkVolume(Value):
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
        positive(self, "diameter", "height")
        if not 0.0 <= self.tilt < 0.5 * np.pi:
            raise MachineError(
                "out of range", key="tilt", value=float(np.degrees(self.tilt)), expected="0 to 90 degrees"
            )
