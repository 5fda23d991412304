"""Bodies of the rigid-body model: capsules about legs and platform line, and what they weigh."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.machine.machine import Machine

_CYLINDER = 0.9  # the fixed part's share of the shortest leg


@dataclass(frozen=True)
class Capsule:
    """low, high: where on an axis its straight part begins and ends; radius, of the ends too. Metres, kilograms."""

    low: float
    high: float
    radius: float
    mass: float

    @property
    def inertia(self) -> float:
        """About an axis across, through the middle, kg·m²: of a homogeneous cylinder with two half balls."""
        length, r = self.high - self.low, self.radius
        cylinder, ball = length, 4.0 / 3.0 * r  # volumes over π r²
        of_cylinder = cylinder * (length**2 / 12.0 + r**2 / 4.0)
        # A half ball: 83/320 r² about its own centre, which is 3/8 r beyond the end.
        of_balls = ball * (83.0 / 320.0 * r**2 + (0.5 * length + 0.375 * r) ** 2)
        return self.mass * (of_cylinder + of_balls) / (cylinder + ball)


def leg_cylinder(machine: Machine, leg: int) -> Capsule:
    """Return the fixed part of a leg; places are metres from the base joint."""
    low = float(machine.legs.min_length[leg])
    return Capsule(0.0, _CYLINDER * low, machine.bodies.leg_radius, machine.masses.cylinder)


def leg_rod(machine: Machine, leg: int) -> Capsule:
    """Return the part that slides out of it; places are metres from the platform joint, towards the platform."""
    low, high = float(machine.legs.min_length[leg]), float(machine.legs.max_length[leg])
    return Capsule(_CYLINDER * low - high, 0.0, 0.6 * machine.bodies.leg_radius, machine.masses.rod)


def spindle(machine: Machine, top: float) -> Capsule:
    """Return the spindle with all that it carries; places are offsets along the platform line, from `top` on."""
    end = machine.tool_length - machine.bodies.shaft_end
    return Capsule(top, end, machine.bodies.shaft_radius, machine.masses.platform)
