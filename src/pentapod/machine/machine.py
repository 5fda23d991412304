"""Machine: a robot that was built. Geometry, limits and bodies, all in SI units."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from pentapod.arrays import Floats, frozen, set_frozen
from pentapod.errors import MachineError
from pentapod.kinematics.guides import ReconfigurablePentapod
from pentapod.kinematics.pentapod import LinearPentapod
from pentapod.kinematics.singularities import architectural_measure
from pentapod.machine.digest import digest_of
from pentapod.machine.drives import Drives, Masses
from pentapod.machine.fields import per_leg, positive
from pentapod.machine.tool_limits import ToolLimits

Interpolation = Literal["linear", "cubic"]

ARCHITECTURAL_LIMIT = 0.005
"""Least `architectural_measure` of a machine: below it, leg lengths say almost nothing about some motion."""


@dataclass(frozen=True, eq=False)
class LegLimits:
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
class JointLimits:
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

    def __post_init__(self) -> None:
        positive(self, *self.__dataclass_fields__)


@dataclass(frozen=True)
class ControllerSettings:
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
        positive(self, "diameter", "height")
        if not 0.0 <= self.tilt < 0.5 * np.pi:
            raise MachineError(
                "out of range", key="tilt", value=float(np.degrees(self.tilt)), expected="0 to 90 degrees"
            )


@dataclass(frozen=True, eq=False)
class Machine:
    """A robot that was built.

    tool_length: metres from p (the platform line's origin, where offset = 0) along i to the tool tip.
    rapid_velocity: largest tip speed in m/s on rapids. drives, masses: for simulation alone; a program does not
    depend on them. tool_limits: of the motion of tip and axis, none unless set. guides: of a reconfigurable machine, on
    which the base joints are set before a program runs; slides (5,) metres: where they stand, `pentapod` is that
    geometry.

    Raises MachineError: the geometry is close to architecturally singular (`ARCHITECTURAL_LIMIT`), or the
    spindle's nose would be above the lowest platform joint.
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
    drives: Drives = field(default_factory=Drives)
    masses: Masses = field(default_factory=Masses)
    tool_limits: ToolLimits = field(default_factory=ToolLimits)
    guides: ReconfigurablePentapod | None = None
    slides: Floats = field(default_factory=lambda: np.zeros(5))
    architecture: float = field(init=False)

    def __post_init__(self) -> None:
        positive(self, "tool_length", "rapid_velocity")
        set_frozen(self, slides=frozen(self.slides, "slides", (5,)))
        measure = architectural_measure(self.pentapod)
        set_frozen(self, architecture=measure)
        if measure < ARCHITECTURAL_LIMIT:
            raise MachineError(
                "the geometry is close to architecturally singular: the legs hold no pose firmly",
                key="base",
                value=float(f"{measure:.3g}"),
                expected=f"a reciprocal condition number of at least {ARCHITECTURAL_LIMIT:g}",
                remedy="spread the base joints: no four near one line, no x or y shared by many",
            )
        room = self.tool_length - float(self.pentapod.offsets.max()) - self.bodies.shaft_end
        if room < 0.0:
            raise MachineError(
                f"the tool is {-room * 1e3:.4g} mm too short: the spindle would end above a platform joint",
                key="tool_length",
                value=self.tool_length,
                expected="at least the largest offset + shaft_end",
            )

    @classmethod
    def load(cls, name_or_path: str | Path) -> Machine:
        """Return a shipped machine by its name ("desk"), or that of a TOML file. Raises MachineError."""
        from pentapod.machine.reader import load_machine  # noqa: PLC0415  the reader builds Machines

        return load_machine(name_or_path)

    @cached_property
    def digest(self) -> str:
        """16 hexadecimal digits over all numbers that programs depend on: equal machines have equal digests.

        Name, drives and masses do not count. With its guides elsewhere it is another machine.
        """
        return digest_of(dict(_numbers(self)))

    def with_tool(self, tool_length: float) -> Machine:
        """Return this machine with another tool: metres from p to the tip. Raises MachineError."""
        return dataclasses.replace(self, tool_length=tool_length)

    def at(self, slides: ArrayLike) -> Machine:
        """Return this machine with its guides at slides (5,), metres.

        Raises MachineError: it has no guides, or is architecturally singular there. Their travel is not looked at.
        """
        if self.guides is None:
            raise MachineError("this machine has no guides", key="guides", value=np.asarray(slides).tolist())
        return dataclasses.replace(self, pentapod=self.guides.at(slides), slides=np.asarray(slides, dtype=np.float64))


def _numbers(machine: Machine) -> Iterator[tuple[str, object]]:
    robot = machine.pentapod
    yield from (("base", robot.base), ("offsets", robot.offsets), ("delta", robot.delta))
    for part in (machine.legs, machine.joints, machine.bodies, machine.controller, machine.work):
        for item in dataclasses.fields(part):
            yield f"{type(part).__name__}.{item.name}", getattr(part, item.name)
    yield from (("tool_length", machine.tool_length), ("rapid_velocity", machine.rapid_velocity))
    yield from machine.tool_limits.given().items()
    if machine.guides is not None:
        yield from (("guides", machine.guides.guides), ("travel", machine.guides.travel))
