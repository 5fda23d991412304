"""Limit of the legs' jerks: |q′ s⃛ + 3 q″ ṡ s̈ + q‴ ṡ³| ≤ j."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.limits.limit import MachineLimit, Motion, Reserve
from pentapod.timing.path.path import PathDerivatives, third_derivatives
from pentapod.timing.path.setpoints import InterpolatedSetpoints

OVERSHOOT = "the spline through the setpoints overshoots where the law's jerk steps"


@dataclass(frozen=True, eq=False)
class LegJerk(MachineLimit):
    """limit, bound (legs,) m/s³: setpoints must keep the bound before they are rounded."""

    quantity = "leg jerk"
    unit = "m/s³"
    group = "jerk"
    of_legs = True
    above = OVERSHOOT

    @classmethod
    def of(cls, machine: Machine, reserve: Reserve) -> LegJerk:
        """Return the machine's limit."""
        limit = reserve.jerk(machine.legs.max_jerk) * reserve.smoother
        return cls(limit, limit / reserve.smoother)

    def jerk_rows(self, path: PathDerivatives) -> Floats:
        """Return the rows (n, legs, 3)."""
        one, two = (y / self.limit for y in path.legs[:2])
        three = third_derivatives(path.s, *path.legs[1:]) / self.limit
        return np.stack([three, 1.5 * two, 0.5 * one], axis=-1)

    def share(self, path: PathDerivatives, motion: Motion) -> Floats:
        """Return the shares (n, legs), none where the motion's jerk is not known."""
        if motion.jerk is None:
            return np.zeros((len(path.s), len(self.limit)))
        return np.abs(motion.jerk_of(path.legs)) / self.limit

    def measured(self, setpoints: InterpolatedSetpoints) -> Floats:
        """Return the jerks (intervals, legs)."""
        return setpoints.legs.jerks[setpoints.own_intervals]
