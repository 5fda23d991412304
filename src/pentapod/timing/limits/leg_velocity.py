"""Limit of the legs' velocities: |q′| ṡ ≤ v."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.limits.limit import MachineLimit, Motion, Reserve
from pentapod.timing.path.path import PathDerivatives
from pentapod.timing.path.setpoints import InterpolatedSetpoints


@dataclass(frozen=True, eq=False)
class LegVelocity(MachineLimit):
    """limit, bound (legs,) m/s."""

    quantity = "leg velocity"
    unit = "m/s"
    group = "speed"
    of_legs = True

    @classmethod
    def of(cls, machine: Machine, reserve: Reserve) -> LegVelocity:
        """Return the machine's limit."""
        return cls(machine.legs.max_velocity * reserve.slower, machine.legs.max_velocity)

    def speed_rows(self, path: PathDerivatives) -> Floats:
        """Return the largest ṡ (n, legs), infinite where a leg stands."""
        with np.errstate(divide="ignore"):
            return self.limit / np.abs(path.legs[0])

    def share(self, path: PathDerivatives, motion: Motion) -> Floats:
        """Return the shares (n, legs)."""
        return np.abs(path.legs[0]) * motion.v[:, None] / self.limit

    def measured(self, setpoints: InterpolatedSetpoints) -> Floats:
        """Return the largest rates (intervals, legs)."""
        return setpoints.legs.rates[setpoints.own_intervals]
