"""Machine: a robot with its limits, bodies, drives and controller, all in SI units."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import MachineError
from pentapod.base.values import Value
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.kinematics.families.reconfigurable import ReconfigurablePentapod
from pentapod.kinematics.robot import Robot
from pentapod.machine import reader
from pentapod.machine.bars import Bars, PassiveLimb
from pentapod.machine.calibration.digest import digest_of
from pentapod.machine.drives import DriveForces, Drives, Masses
from pentapod.machine.fields import for_legs, positive
from pentapod.machine.leg_model import LegModel
from pentapod.machine.parts import (
    Bodies,
    ControllerSettings,
    Guard,
    JointLimits,
    LegLimits,
    Park,
    Stiffness,
    ToolLimits,
    WorkVolume,
)

if TYPE_CHECKING:
    from pentapod.machine.calibration.record import CalibrationRecord

UPWARDS = np.array([0.0, 0.0, 1.0])

ARCHITECTURAL_LIMIT = 0.005
"""Least `conditioning` of a machine's robot: below it, some motion hardly changes the leg lengths."""


@dataclass(frozen=True, eq=False)
class Machine(Value):
    """A robot with its limits, bodies, drives and controller.

    tool_length: metres from p (the platform line's origin, where offset = 0) along i to the tool tip. rapid_velocity:
    largest tip speed on rapids, m/s. drives, masses: programs depend on them only where drive_forces has limits;
    cutting_force: newtons on the tip, in any direction, that drives with limits keep free on cuts. park: where the
    machine waits. guard: what its controller must leave of its limits. guides: of a reconfigurable machine, on which
    the base joints are set before a program runs; rail_positions (n_legs,) metres: where they stand; `robot` is the
    geometry there. calibration: from which `robot` is the machine as built; None where it is the one that was designed.
    leg_model: from readings to what drives are told, in posts; screws_at (3,): position, tool upright, in which screws
    count as not turned, whatever the tool: by default the middle of the work volume for the first tool's tip. limb: the
    passive limb that holds the platform, where one does.

    Raises MachineError: the geometry is close to architecturally singular (`ARCHITECTURAL_LIMIT`), or the
    spindle's nose would be above the lowest platform joint.

    >>> machine = Machine.load("desk")
    >>> machine.robot.n_legs, machine.tool_length
    (5, 0.198)
    """

    summary = ("name",)

    name: str
    robot: Robot
    legs: LegLimits
    joints: JointLimits
    bodies: Bodies
    tool_length: float
    rapid_velocity: float
    controller: ControllerSettings
    work: WorkVolume
    drives: Drives = field(default_factory=Drives)
    masses: Masses = field(default_factory=Masses)
    drive_forces: DriveForces = field(default_factory=DriveForces)
    cutting_force: float = 0.0
    stiffness: Stiffness = field(default_factory=Stiffness)
    tool_limits: ToolLimits = field(default_factory=ToolLimits)
    park: Park = field(default_factory=Park)
    guard: Guard = field(default_factory=Guard)
    guides: ReconfigurablePentapod | None = None
    calibration: CalibrationRecord | None = None
    leg_model: LegModel = field(default_factory=LegModel)
    limb: PassiveLimb | None = None
    rail_positions: Floats = field(default_factory=lambda: np.zeros(1))
    screws_at: Floats | None = None
    architecture: float = field(init=False)

    def __post_init__(self) -> None:
        positive(self, "tool_length", "rapid_velocity")
        count = self.robot.n_legs
        parts = ("legs", "joints", "drives", "drive_forces", "leg_model", "stiffness")
        each = {name: for_legs(getattr(self, name), count) for name in parts}
        set_frozen(self, **each)
        self._check_legs()
        if self.screws_at is None:
            set_frozen(self, screws_at=self.work.centre - self.tool_length * UPWARDS)
        rails = (
            np.broadcast_to(self.rail_positions, (count,)) if np.size(self.rail_positions) == 1 else self.rail_positions
        )
        set_frozen(self, rail_positions=frozen(rails, "rail_positions", (count,)))
        measure = self.robot.conditioning
        set_frozen(self, architecture=measure)
        if measure < ARCHITECTURAL_LIMIT:
            raise MachineError(
                "the geometry is close to architecturally singular: the legs hold no pose firmly",
                key="base",
                value=float(f"{measure:.3g}"),
                expected=f"a reciprocal condition number of at least {ARCHITECTURAL_LIMIT:g}",
                remedy="spread the base joints: no four near one line, no x or y shared by many",
            )
        room = self.tool_length - float(self.bars.offsets.max()) - self.bodies.shaft_end
        if room < 0.0:
            raise MachineError(
                f"the tool is {-room * 1e3:.4g} mm too short: the spindle would end above a platform joint",
                key="tool_length",
                value=self.tool_length,
                expected="at least the largest offset + shaft_end",
            )

    def _check_legs(self) -> None:
        """Raise MachineError where a limit is not given for each leg, or the guides are another robot's."""
        count = self.robot.n_legs
        rows = {
            "min_length": self.legs.min_length,
            "base_cone": self.joints.base_cone,
            "moving_mass": self.drives.moving_mass,
            "peak_force": self.drive_forces.peak_force,
            "leg_stiffness": self.stiffness.leg_stiffness,
        }
        for key, values in rows.items():
            if len(values) != count:
                raise MachineError("wrong count", key=key, value=len(values), expected=f"one for each of {count} legs")
        if self.drive_forces.limited and not self.leg_forces_known:
            raise MachineError(
                "forces of the drives are known only where all legs end on the tool's line or on rings around it, and "
                "nothing else holds it",
                key="peak_force",
                value=self.drive_forces.peak_force.tolist(),
                remedy="leave it out, or describe the machine without arms and passive limb",
            )
        if self.guides is not None and not isinstance(self.robot, LinearPentapod):
            raise MachineError(
                "guides are for machines of the quadratic family alone",
                key="guides",
                value=type(self.robot).__name__,
                remedy="describe a machine without guides, with the base joints where they stand",
            )

    @classmethod
    def load(cls, name_or_path: str | Path) -> Machine:
        """Return a shipped machine by its name ("desk"), or the machine of a TOML file. Raises MachineError.

        A text without folder and suffix is taken for a name first. The error is one line with file, line, key, value
        and remedy.
        """
        return reader.load(name_or_path, cls)

    @cached_property
    def digest(self) -> str:
        """16 hexadecimal digits of a SHA-256 over all numbers that programs depend on, −0 counted as 0.

        The name does not count, nor do drives and masses unless the drives' forces are limited. With its guides
        elsewhere it is another machine.
        """
        return digest_of(dict(_numbers(self)))

    @cached_property
    def bars(self) -> Bars:
        """The legs, and the passive limb, as bodies."""
        return Bars(self.robot, self.limb, self.bodies.leg_radius)

    @property
    def leg_forces_known(self) -> bool:
        """Whether all legs end on the platform line, or on rings around it, and nothing else holds it."""
        return not self.robot.arms.any() and self.limb is None

    @property
    def yielding_known(self) -> bool:
        """Whether the machine says how far its legs yield, and the forces in them are known."""
        return self.stiffness.given and self.leg_forces_known

    @property
    def line_top(self) -> float:
        """The least offset (metres) of a joint on the platform line: there the spindle begins."""
        return float(self.bars.offsets.min())

    @property
    def calibration_name(self) -> str:
        """What programs name as the machine's calibration; "" where there is none."""
        return "" if self.calibration is None else self.calibration.name

    def commands(self, legs: ArrayLike, branch: ArrayLike) -> Floats:
        """Return what the drives are told (N, n_legs) so that the legs read `legs` (N, n_legs), in order: `LegModel`.

        branch: signs (2,), or (N, 2) of each row. NaN where readings have no pose in the branch.
        """
        return self.leg_model.commands(self.robot, legs, branch, (cast(Floats, self.screws_at), UPWARDS))

    def readings(self, commands: ArrayLike, branch: ArrayLike) -> Floats:
        """Return what the legs read (N, n_legs) where the drives were told `commands`: the inverse of `commands`."""
        return self.leg_model.readings(self.robot, commands, branch, (cast(Floats, self.screws_at), UPWARDS))

    def with_tool(self, tool_length: float) -> Machine:
        """Return this machine with another tool: metres from p to the tip. Raises MachineError."""
        return dataclasses.replace(self, tool_length=tool_length)

    def at(self, rail_positions: ArrayLike) -> Machine:
        """Return this machine with its guides at `rail_positions` (n_legs,), metres; their travel is not checked.

        Raises MachineError: it has no guides, or is architecturally singular there.
        """
        if self.guides is None:
            raise MachineError("this machine has no guides", key="guides", value=np.asarray(rail_positions).tolist())
        return dataclasses.replace(
            self, robot=self.guides.at(rail_positions), rail_positions=np.asarray(rail_positions, dtype=np.float64)
        )


def load_machine(name_or_path: str | Path) -> Machine:
    """Return a shipped machine by its name, or the machine of a TOML file, as `Machine.load` does."""
    return Machine.load(name_or_path)


def read_machine(text: str, file: str | Path) -> Machine:
    """Return the machine that TOML text describes; `file` is named in errors. Raises MachineError."""
    return reader.read(text, file, Machine)


def _numbers(machine: Machine) -> Iterator[tuple[str, object]]:
    yield from machine.robot.numbers.items()
    for part in (machine.legs, machine.joints, machine.bodies, machine.controller, machine.work):
        for item in dataclasses.fields(part):
            yield f"{type(part).__name__}.{item.name}", getattr(part, item.name)
    yield from (("tool_length", machine.tool_length), ("rapid_velocity", machine.rapid_velocity))
    yield from machine.tool_limits.given().items()
    if machine.drive_forces.limited:
        yield from machine.drive_forces.given().items()
        yield from (("moving_mass", machine.drives.moving_mass), ("cutting_force", machine.cutting_force))
        yield from ((item.name, getattr(machine.masses, item.name)) for item in dataclasses.fields(machine.masses))
    if machine.limb is not None:
        yield from machine.limb.numbers()
    if machine.guides is not None:
        yield from (("guides", machine.guides.guides), ("travel", machine.guides.travel))
