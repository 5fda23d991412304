"""Bodies of the rigid-body model: capsules around legs and platform line, with their masses and inertias."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.machine.bars import PassiveLimb
from pentapod.machine.machine import Machine

CYLINDER_SHARE = 0.9
"""Length of a leg's fixed part as a share of the shortest leg."""
ROD_SHARE = 0.6
"""Radius of a leg's moving part as a share of the leg's radius."""


@dataclass(frozen=True)
class Capsule:
    """Capsule on an axis: a cylinder from low to high with half balls at its ends. Metres, kilograms."""

    low: float
    high: float
    radius: float
    mass: float

    @property
    def inertia(self) -> float:
        """Transverse inertia about the middle, kg·m², of a homogeneous body."""
        length, r = self.high - self.low, self.radius
        cylinder, ball = length, 4.0 / 3.0 * r  # volumes over π r²
        of_cylinder = cylinder * (length**2 / 12.0 + r**2 / 4.0)
        # A half ball: 83/320 r² about its own centre, which is 3/8 r beyond the end.
        of_balls = ball * (83.0 / 320.0 * r**2 + (0.5 * length + 0.375 * r) ** 2)
        return self.mass * (of_cylinder + of_balls) / (cylinder + ball)

    @property
    def moments(self) -> tuple[float, float, float]:
        """Mass, and its first and second moment about the axis's origin, across the axis: kg, kg·m, kg·m²."""
        middle = 0.5 * (self.low + self.high)
        return self.mass, self.mass * middle, self.mass * middle**2 + self.inertia

    @property
    def axial_inertia(self) -> float:
        """Inertia about the axis, kg·m², of a homogeneous body."""
        length, r = self.high - self.low, self.radius
        cylinder, ball = length, 4.0 / 3.0 * r  # volumes over π r²
        return self.mass * r**2 * (0.5 * cylinder + 0.4 * ball) / (cylinder + ball)


def leg_cylinder(machine: Machine, leg: int) -> Capsule:
    """Return the fixed part of a leg; positions from the base joint."""
    return _cylinder(machine, float(machine.legs.min_length[leg]), machine.bodies.leg_radius)


def leg_rod(machine: Machine, leg: int) -> Capsule:
    """Return the part that slides out of it; positions from the platform joint, towards the platform."""
    low, high = float(machine.legs.min_length[leg]), float(machine.legs.max_length[leg])
    return _rod(machine, low, high, machine.bodies.leg_radius)


def limb_strut(machine: Machine, limb: PassiveLimb) -> tuple[Capsule, Capsule]:
    """Return the strut's part at the rail, positions from there, and the one that slides in it, from its joint."""
    low, high = limb.strut.tolist()
    return _cylinder(machine, low, limb.radius), _rod(machine, low, high, limb.radius)


def _cylinder(machine: Machine, low: float, radius: float) -> Capsule:
    return Capsule(0.0, CYLINDER_SHARE * low, radius, machine.masses.cylinder)


def _rod(machine: Machine, low: float, high: float, radius: float) -> Capsule:
    return Capsule(CYLINDER_SHARE * low - high, 0.0, ROD_SHARE * radius, machine.masses.rod)


def spindle(machine: Machine, top: float) -> Capsule:
    """Return spindle and tool holder; positions are offsets along the platform line, from `top` on."""
    end = machine.tool_length - machine.bodies.shaft_end
    return Capsule(top, end, machine.bodies.shaft_radius, machine.masses.platform)
