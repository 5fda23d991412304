"""What moves the legs, and what they move: numbers for simulation, on which no program depends."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import MachineError
from pentapod.base.values import Value
from pentapod.machine.fields import not_negative, per_leg, positive


@dataclass(frozen=True, eq=False)
class Drives(Value):
    """Five servo drives: a proportional position loop around a velocity loop with an integrator, and feed-forward.

        rate error = position_gain · (wanted − x) + velocity_feedforward · rate wanted − rate
        acceleration = velocity_gain · (rate error + velocity_integral · ∫ rate error)
                       + acceleration_feedforward · acceleration wanted + load_feedforward · load / moving_mass

    Arrays (5,), scalars hold for all legs: position_gain, velocity_gain and velocity_integral in 1/s; moving_mass in
    kg: what a drive feels, the inertia of motor and screw included; ripple_force in N: amplitude of a force that goes
    up and down once in ripple_pitch metres of travel. The others hold for all legs. velocity_feedforward,
    acceleration_feedforward and load_feedforward: shares, 1 is full; the load is that of the `Masses`. encoder_step:
    metres, 0 for none. dead_time: seconds from reading the encoder to the force. period: seconds of the drive's own
    loop. contour_margin: what is faster than the correction by pose can answer, this correction may enlarge so many
    times; the less, the slower it is.

    Raises MachineError: numbers that are negative or not finite, gains, masses, pitch or period that are 0, a margin
    below 1.1.
    """

    position_gain: Floats = field(default_factory=lambda: np.full(5, 80.0))
    velocity_gain: Floats = field(default_factory=lambda: np.full(5, 600.0))
    velocity_integral: Floats = field(default_factory=lambda: np.full(5, 50.0))
    moving_mass: Floats = field(default_factory=lambda: np.full(5, 100.0))
    ripple_force: Floats = field(default_factory=lambda: np.full(5, 20.0))
    ripple_pitch: Floats = field(default_factory=lambda: np.full(5, 5e-3))
    velocity_feedforward: float = 1.0
    acceleration_feedforward: float = 1.0
    load_feedforward: float = 1.0
    encoder_step: float = 1e-7
    dead_time: float = 2.5e-4
    period: float = 1.25e-4
    contour_margin: float = 2.0

    def __post_init__(self) -> None:
        gains = ("position_gain", "velocity_gain", "moving_mass", "ripple_pitch")
        per_leg(self, *gains, "velocity_integral", "ripple_force")
        positive(self, *gains, "period")
        shares = ("velocity_feedforward", "acceleration_feedforward", "load_feedforward")
        not_negative(self, "velocity_integral", "ripple_force", *shares, "encoder_step", "dead_time")
        if not 1.1 <= self.contour_margin < np.inf:
            raise MachineError("too small", key="contour_margin", value=self.contour_margin, expected="1.1 or more")


@dataclass(frozen=True, eq=False)
class Masses(Value):
    """Masses for the rigid-body simulation.

    cylinder, rod: of the fixed and of the moving part of each leg, kg; platform: of the spindle with all that it
    carries, kg, spread along the platform line. gravity (3,): m/s², machine frame. Raises MachineError.
    """

    cylinder: float = 1.5
    rod: float = 0.7
    platform: float = 3.0
    gravity: Floats = field(default_factory=lambda: np.array([0.0, 0.0, 9.81]))

    def __post_init__(self) -> None:
        positive(self, "cylinder", "rod", "platform")
        try:
            set_frozen(self, gravity=frozen(self.gravity, "gravity", (3,)))
        except ValueError as error:
            raise MachineError("not three numbers", key="gravity", value=np.asarray(self.gravity).tolist()) from error
