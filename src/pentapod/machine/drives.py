"""Drives and masses: numbers for simulation, and for programs where the drives' forces are limited."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import MachineError
from pentapod.base.keys import Key, check_fields, declared
from pentapod.base.values import Value
from pentapod.machine.fields import LIST_OF_3, PER_LEG, each_leg, per_leg


@dataclass(frozen=True, eq=False)
class Drives(Value):
    """Five servo drives: a proportional position loop around a velocity loop with an integrator, and feed-forward.

        rate error = position_gain · (wanted − x) + velocity_feedforward · rate wanted − rate
        acceleration = velocity_gain · (rate error + velocity_integral · ∫ rate error)
                       + acceleration_feedforward · acceleration wanted + load_feedforward · load / moving_mass

    Arrays (n,), where scalars hold for all legs: gains in 1/s, moving_mass in kg, ripple_force in N with the period
    ripple_pitch, metres of travel. The other fields hold for all legs, SI; the load is that of the `Masses`. Raises
    MachineError: numbers out of range or not finite.
    """

    position_gain: Annotated[Floats, Key("per_s", "gain of the position loop (Kv)", kind=PER_LEG, gt=0.0)] = field(
        default_factory=each_leg(80.0)
    )
    velocity_gain: Annotated[
        Floats, Key("per_s", "gain of the velocity loop, its bandwidth in rad/s", kind=PER_LEG, gt=0.0)
    ] = field(default_factory=each_leg(600.0))
    velocity_integral: Annotated[
        Floats, Key("per_s", "integral share of the velocity loop, 1 / reset time", kind=PER_LEG, ge=0.0)
    ] = field(default_factory=each_leg(50.0))
    moving_mass: Annotated[
        Floats, Key("kg", "moving mass seen by a drive, motor and screw included", kind=PER_LEG, gt=0.0)
    ] = field(default_factory=each_leg(100.0))
    ripple_force: Annotated[Floats, Key("n", "amplitude of the force ripple", "ripple", kind=PER_LEG, ge=0.0)] = field(
        default_factory=each_leg(20.0)
    )
    ripple_pitch: Annotated[Floats, Key("mm", "travel of one period of the ripple", kind=PER_LEG, gt=0.0)] = field(
        default_factory=each_leg(5e-3)
    )
    velocity_feedforward: Annotated[
        float, Key("", "share of the wanted velocity given to the velocity loop", ge=0.0, le=2.0)
    ] = 1.0
    acceleration_feedforward: Annotated[
        float, Key("", "share of the wanted acceleration given as a force", ge=0.0, le=2.0)
    ] = 1.0
    load_feedforward: Annotated[
        float, Key("", "share of the forces that [masses] need given; MuJoCo alone", ge=0.0, le=2.0)
    ] = 1.0
    encoder_step: Annotated[float, Key("mm", "resolution of the leg scales; 0: continuous", ge=0.0)] = 1e-4 / 1e3
    dead_time: Annotated[float, Key("ms", "delay from reading the scale to the force", ge=0.0)] = 2.5e-4
    period: Annotated[float, Key("ms", "period of the drive's own loop", gt=0.0)] = 1.25e-4
    contour_margin: Annotated[
        float,
        Key("", "largest gain of the pose correction at any frequency; smaller values make it slower", ge=1.1),
    ] = 2.0

    def __post_init__(self) -> None:
        per_leg(self, *(item.field for item in declared(Drives) if item.key.kind is PER_LEG))
        check_fields(self, MachineError)


@dataclass(frozen=True, eq=False)
class DriveForces(Value):
    """The force that each drive has, and the friction that takes part of it; infinite where there is no limit.

    A drive has its peak force up to the knee; from there on it falls linearly to 0 at the no-load velocity. Friction
    always counts against the drive: the help that it is in braking is not used. Arrays (n,), where scalars hold for all
    legs: N, m/s, and N·s/m for the viscous friction. Raises MachineError.
    """

    peak_force: Annotated[
        Floats, Key("n", "largest force of a drive; with it masses and drives belong to the machine", kind=PER_LEG)
    ] = field(default_factory=each_leg(math.inf))
    continuous_force: Annotated[
        Floats, Key("n", "force that a drive bears all the time, root mean square", kind=PER_LEG)
    ] = field(default_factory=each_leg(math.inf))
    knee_velocity: Annotated[
        Floats, Key("mm_s", "leg velocity up to which a drive has its peak force; 0: it falls from rest", kind=PER_LEG)
    ] = field(default_factory=each_leg(0.0))
    no_load_velocity: Annotated[
        Floats, Key("mm_s", "leg velocity at which no force is left; without it velocity costs none", kind=PER_LEG)
    ] = field(default_factory=each_leg(math.inf))
    coulomb_friction: Annotated[
        Floats, Key("n", "friction of a leg that moves, whatever its velocity", kind=PER_LEG)
    ] = field(default_factory=each_leg(0.0))
    viscous_friction: Annotated[
        Floats, Key("n_s_m", "friction of a leg in proportion to its velocity", kind=PER_LEG)
    ] = field(default_factory=each_leg(0.0))

    def __post_init__(self) -> None:
        per_leg(self, *self.__dataclass_fields__, finite=False)
        for name, values in vars(self).items():
            zero = name in ("knee_velocity", "coulomb_friction", "viscous_friction")
            if not (np.isfinite(values) & (values >= 0.0) if zero else values > 0.0).all():
                what = "must not be negative" if zero else "must be positive"
                raise MachineError(what, key=name, value=values.tolist())
        for name, least, than in (
            ("no_load_velocity", self.knee_velocity, "knee_velocity"),
            ("peak_force", np.where(np.isinf(self.continuous_force), 0.0, self.continuous_force), "continuous_force"),
        ):
            values = getattr(self, name)
            if not (values > least if than == "knee_velocity" else values >= least).all():
                expected = f"{'more than' if than == 'knee_velocity' else 'at least'} {than}, {least.tolist()}"
                raise MachineError("too small", key=name, value=values.tolist(), expected=expected)
        if not self.limited and (np.isfinite(self.continuous_force) | np.isfinite(self.no_load_velocity)).any():
            raise MachineError("needs the peak force", key="peak_force", expected="a force for each drive, newtons")

    @property
    def limited(self) -> bool:
        """Whether the forces are limited: then programs depend on drives and masses."""
        return bool(np.isfinite(self.peak_force).any())

    @property
    def fall(self) -> Floats:
        """Force (n,) that is lost for each m/s beyond the knee, N·s/m."""
        return np.where(
            np.isfinite(self.no_load_velocity), self.peak_force / (self.no_load_velocity - self.knee_velocity), 0.0
        )

    def available(self, rates: Floats) -> Floats:
        """Return the force (N, n) of the drives at rates of the legs (N, n), m/s."""
        return self.peak_force - self.fall * np.maximum(np.abs(rates) - self.knee_velocity, 0.0)

    def friction(self, rates: Floats) -> Floats:
        """Return the largest friction (N, n) at rates of the legs (N, n), m/s; that of a leg at rest counts in full."""
        return self.coulomb_friction + self.viscous_friction * np.abs(rates)

    def given(self) -> dict[str, Floats]:
        """Return what is given, by name, with infinite values as −1; nothing where the forces are not limited."""
        return {name: np.where(np.isinf(y), -1.0, y) for name, y in vars(self).items()} if self.limited else {}


@dataclass(frozen=True, eq=False)
class Masses(Value):
    """Masses for `pentapod simulate --engine mujoco`, and for machines whose drives have a peak force.

    platform: of the spindle with all that it carries, spread along the platform line. gravity (3,): m/s², machine
    frame. Raises MachineError.
    """

    cylinder: Annotated[float, Key("kg", "fixed part of each leg", gt=0.0)] = 1.5
    rod: Annotated[float, Key("kg", "moving part of each leg", gt=0.0)] = 0.7
    platform: Annotated[float, Key("kg", "spindle and tool", gt=0.0)] = 3.0
    gravity: Annotated[Floats, Key("m_s2", "machine frame; +z points from the base to the work", kind=LIST_OF_3)] = (
        field(default_factory=lambda: np.array([0.0, 0.0, 9.81]))
    )

    def __post_init__(self) -> None:
        try:
            set_frozen(self, gravity=frozen(self.gravity, "gravity", (3,)))
        except ValueError as error:
            raise MachineError("not three numbers", key="gravity", value=np.asarray(self.gravity).tolist()) from error
        check_fields(self, MachineError)
