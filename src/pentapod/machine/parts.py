"""The parts of a machine beside its geometry: limits of legs, joints and tool, bodies, controller, work volume."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import MachineError
from pentapod.base.keys import Key, check_fields
from pentapod.base.values import Value
from pentapod.geometry.interpolant import Interpolation
from pentapod.machine.fields import LEG_AXES, LIST_OF_3, PER_LEG, each_leg, per_leg, positive


@dataclass(frozen=True, eq=False)
class LegLimits(Value):
    """Limits of each leg.

    Arrays (n,), SI; scalars hold for all legs. Raises MachineError: not positive and finite, min_length ≥ max_length.
    """

    min_length: Annotated[Floats, Key("mm", "shortest leg, base joint to platform joint", kind=PER_LEG)]
    max_length: Annotated[Floats, Key("mm", "longest leg", kind=PER_LEG)]
    max_velocity: Annotated[Floats, Key("mm_s", "largest rate of a leg", kind=PER_LEG)]
    max_acceleration: Annotated[Floats, Key("mm_s2", "largest acceleration of a leg", kind=PER_LEG)]
    max_jerk: Annotated[Floats, Key("mm_s3", "largest jerk of a leg", kind=PER_LEG)]

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
        """max_length − min_length, (n_legs,) metres."""
        return self.max_length - self.min_length


@dataclass(frozen=True, eq=False)
class JointLimits(Value):
    """Cones within which the joints let the legs move.

    base_axes (n_legs, 3): unit axis of each base joint's cone, machine frame. base_cone (n_legs,): largest angle of the
    leg to that axis, radians. platform_range (n_legs, 2): least and largest angle in radians between the leg
    (from platform joint towards base joint) and the tool axis tip → spindle.

    Raises MachineError: axes that are not unit to 1e-3 (they are then normalised), a cone beyond 90°, a range
    that is empty or beyond 0..180°.
    """

    base_axes: Annotated[
        Floats,
        Key("", "unit axis of each base joint's cone, from the base into the work", "base_axis", kind=LEG_AXES),
    ]
    base_cone: Annotated[Floats, Key("deg", "largest angle between leg and that axis", kind=PER_LEG)]
    platform_range: Floats

    def __post_init__(self) -> None:
        per_leg(self, "base_cone", base_axes=3, platform_range=2)
        positive(self, "base_cone")
        axes, limits = self.base_axes, self.platform_range
        norms = np.linalg.norm(axes, axis=1, keepdims=True)
        if (np.abs(norms - 1.0) > 1e-3).any():
            leg = int(np.argmax(np.abs(norms - 1.0)))
            raise MachineError(f"leg {leg + 1}: not a unit vector", key="base_axes", value=axes[leg].tolist())
        if (self.base_cone > 0.5 * np.pi).any():
            raise MachineError("beyond 90 degrees", key="base_cone", value=np.degrees(self.base_cone).tolist())
        if (limits[:, 0] < 0.0).any() or (limits[:, 1] > np.pi).any() or (limits[:, 0] >= limits[:, 1]).any():
            value = np.degrees(limits).tolist()
            raise MachineError("not a range", key="platform_range", value=value, expected="0 ≤ min < max ≤ 180 degrees")
        set_frozen(self, base_axes=frozen(axes / norms, "base_axes"))


@dataclass(frozen=True, eq=False)
class LegStiffness(Value):
    """How stiff the legs are along themselves: springs in series, infinite where nothing yields. Arrays (n,), SI."""

    leg_stiffness: Annotated[
        Floats,
        Key("n_um", "stiffness of a leg along itself, drive and bearings included", "stiffness", kind=PER_LEG),
    ] = field(default_factory=each_leg(math.inf))
    leg_rigidity: Annotated[
        Floats,
        Key(
            "kn",
            "E A of what gets softer with the leg's length, such as a screw: it yields like a spring of E A / length, "
            "in series with the other",
            "rigidity",
            kind=PER_LEG,
        ),
    ] = field(default_factory=each_leg(math.inf))


@dataclass(frozen=True, eq=False)
class JointStiffness(Value):
    """How stiff a leg's joints are along it, infinite where they do not yield. Array (n,), N/m."""

    joint_stiffness: Annotated[
        Floats,
        Key(
            "n_um",
            "stiffness of a leg's two joints together, along the leg; in series with the leg",
            "stiffness",
            kind=PER_LEG,
        ),
    ] = field(default_factory=each_leg(math.inf))


@dataclass(frozen=True, eq=False)
class Stiffness(JointStiffness, LegStiffness):
    """Springs of legs and joints, in series along each leg. Base and platform are rigid.

    Arrays (n,), where scalars hold for all legs; infinite where nothing is given. Raises MachineError: not positive.
    """

    def __post_init__(self) -> None:
        per_leg(self, *self.__dataclass_fields__, finite=False)
        for name, values in vars(self).items():
            if not (values > 0.0).all():
                raise MachineError("must be positive", key=name, value=values.tolist())

    @property
    def given(self) -> bool:
        """Whether anything yields."""
        return any(bool(np.isfinite(values).any()) for values in vars(self).values())

    def yielding(self, lengths: Floats) -> Floats:
        """Return how far legs of these lengths (..., n), metres, get shorter by 1 N, m/N."""
        return 1.0 / self.leg_stiffness + 1.0 / self.joint_stiffness + lengths / self.leg_rigidity


@dataclass(frozen=True)
class Bodies(Value):
    """Simple bodies around the legs and the platform line.

    leg_radius: each leg is a capsule from base joint to platform joint. shaft_radius: the spindle is a capsule along
    the line, from the platform joint farthest from the tip to `shaft_end` metres short of the tip. Within
    `joint_radius` of a leg's own platform joint, leg and spindle are joined and do not collide.
    """

    leg_radius: Annotated[
        float, Key("mm", "diameter of the legs, cylinders with round ends", "leg_diameter", 0.5, gt=0.0)
    ]
    shaft_radius: Annotated[
        float, Key("mm", "diameter of the spindle, a cylinder along the platform line", "shaft_diameter", 0.5, gt=0.0)
    ]
    shaft_end: Annotated[float, Key("mm", "distance from the spindle's end to the tip", gt=0.0)]
    joint_radius: Annotated[
        float, Key("mm", "distance from its own platform joint within which a leg may be inside the spindle", gt=0.0)
    ]

    def __post_init__(self) -> None:
        check_fields(self, MachineError)


@dataclass(frozen=True)
class ToolLimits(Value):
    """Limits of the tool's own motion, as spindles, hoses and workpieces may set them; infinite where there is none.

    Tip: m/s² and m/s³; direction of the tool axis: rad/s and rad/s². Raises MachineError: not positive.
    """

    max_tip_acceleration: Annotated[
        float, Key("mm_s2", "largest acceleration of the tip; of machine and job the smaller", gt=0.0)
    ] = math.inf
    max_tip_jerk: Annotated[float, Key("mm_s3", "largest jerk of the tip; of machine and job the smaller", gt=0.0)] = (
        math.inf
    )
    max_axis_velocity: Annotated[
        float, Key("deg_s", "largest angular velocity of the tool axis; of machine and job the smaller", gt=0.0)
    ] = math.inf
    max_axis_acceleration: Annotated[
        float, Key("deg_s2", "largest angular acceleration of the tool axis; of machine and job the smaller", gt=0.0)
    ] = math.inf

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0.0:
                raise MachineError("must be positive", key=name, value=value)

    def given(self) -> dict[str, float]:
        """Return the limits that are set, by name."""
        return {name: float(value) for name, value in vars(self).items() if value < math.inf}

    def and_(self, other: ToolLimits) -> ToolLimits:
        """Return the stricter of both, limit by limit."""
        return ToolLimits(**{name: min(value, getattr(other, name)) for name, value in vars(self).items()})


@dataclass(frozen=True)
class ControllerSettings(Value):
    """How the controller moves through its setpoints. period: seconds between them."""

    period: Annotated[float, Key("ms", "time between setpoints", gt=0.0)]
    interpolation: Annotated[Interpolation, Key("", "interpolation between setpoints")]

    def __post_init__(self) -> None:
        check_fields(self, MachineError)


@dataclass(frozen=True, eq=False)
class WorkVolume(Value):
    """The advertised work volume: a cylinder of tips and a cone of tool axes, machine frame.

    centre (3,), diameter, height (along z): metres. tilt: largest angle in radians between the tool axis and −z, which
    points from the work to the base.
    """

    centre: Annotated[Floats, Key("mm", "centre of the cylinder", kind=LIST_OF_3)]
    diameter: Annotated[float, Key("mm", "diameter of the cylinder of tip positions", gt=0.0)]
    height: Annotated[float, Key("mm", "height of the cylinder, along z", gt=0.0)]
    tilt: Annotated[float, Key("deg", "largest angle between tool axis and −z", ge=0.0, lt=90.0)]

    def __post_init__(self) -> None:
        set_frozen(self, centre=frozen(self.centre, "centre", (3,)))
        check_fields(self, MachineError)

    def outside(self, tips: Floats) -> float:
        """Return how far tips (N, 3) are outside the cylinder, across or along z, at most; 0 where all are inside."""
        across, along = np.linalg.norm((tips - self.centre)[:, :2], axis=1), np.abs((tips - self.centre)[:, 2])
        return float(max((across - 0.5 * self.diameter).max(), (along - 0.5 * self.height).max(), 0.0))


@dataclass(frozen=True, eq=False)
class Park(Value):
    """The pose in which the machine waits before and after a program, machine frame; none where no tip is given.

    tip (3,): metres. axis (3,): unit, tip → spindle; None for −z, the upright tool. Programs do not depend on it: it is
    not in the machine's digest. Raises MachineError: an axis without tip, or one that is not of unit length to 1e-3 (it
    is then normalised).
    """

    tip: Annotated[
        Floats | None,
        Key("mm", "tip of the tool where the machine waits; plans make the ways from there and back", kind=LIST_OF_3),
    ] = None
    axis: Annotated[
        Floats | None, Key("", "tool axis there, unit, tip to spindle; upright by default", kind=LIST_OF_3)
    ] = None

    def __post_init__(self) -> None:
        if self.tip is None:
            if self.axis is not None:
                raise MachineError(
                    "a park pose needs its tip", key="park.tip_mm", expected="[x, y, z], as in work.centre_mm"
                )
            return
        set_frozen(self, tip=frozen(self.tip, "park.tip_mm", (3,)))
        if self.axis is not None:
            axis = np.asarray(self.axis, dtype=np.float64)
            length = float(np.linalg.norm(axis))
            if not abs(length - 1.0) < 1e-3:
                expected = "a unit vector, [0, 0, -1] upright"
                raise MachineError("not of unit length", key="park.axis", value=axis.tolist(), expected=expected)
            set_frozen(self, axis=frozen(axis / length, "park.axis", (3,)))

    @property
    def pose(self) -> tuple[Floats, Floats] | None:
        """Tip and tool axis (3,); None where the machine has no park pose."""
        if self.tip is None:
            return None
        return self.tip, np.array([0.0, 0.0, -1.0]) if self.axis is None else self.axis


@dataclass(frozen=True)
class Guard(Value):
    """What the kinematics of a controller must leave in every pose, beyond the machine's own limits.

    w: sine of the angle between tool axis and base plane. surface, stroke, leg_gap, shaft_gap: metres, to the singular
    surface S = 0, to the ends of strokes, between legs, and from a leg to the spindle. Programs do not depend on it.
    """

    w: Annotated[float, Key("", "least sine of the angle between tool axis and base plane", ge=0.0, lt=1.0)] = 0.1
    surface: Annotated[float, Key("mm", "least way to the singular surface S = 0", ge=0.0)] = 0.020
    stroke: Annotated[float, Key("mm", "least way of a leg to an end of its stroke", ge=0.0)] = 0.0
    leg_gap: Annotated[float, Key("mm", "least gap between two legs", ge=0.0)] = 0.001
    shaft_gap: Annotated[float, Key("mm", "least gap between a leg and the spindle", ge=0.0)] = 0.001

    def __post_init__(self) -> None:
        check_fields(self, MachineError)
