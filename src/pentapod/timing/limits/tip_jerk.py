"""Limit of the tip's jerk: |T′ s⃛ + 3 T″ ṡ s̈ + T‴ ṡ³| ≤ j."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.machine.rounding import TIP_ROUNDING
from pentapod.timing.limits.leg_jerk import OVERSHOOT
from pentapod.timing.limits.limit import MachineLimit, Motion, Reserve
from pentapod.timing.limits.polytopes import polyhedron
from pentapod.timing.path.path import PathDerivatives, third_derivatives
from pentapod.timing.path.setpoints import InterpolatedSetpoints


@dataclass(frozen=True, eq=False)
class TipJerk(MachineLimit):
    """limit, bound (1,) m/s³: setpoints must keep the bound before they are rounded."""

    quantity = "tip jerk"
    unit = "m/s³"
    group = "jerk"
    of_tool = True
    above = OVERSHOOT

    @classmethod
    def of(cls, machine: Machine, reserve: Reserve) -> TipJerk | None:
        """Return the machine's limit, None where it sets none."""
        limit = np.atleast_1d(reserve.jerk(machine.tool_limits.max_tip_jerk, TIP_ROUNDING) * reserve.smoother)
        return cls(limit, limit / reserve.smoother) if np.isfinite(limit).all() else None

    def jerk_rows(self, path: PathDerivatives) -> Floats:
        """Return the rows of a polyhedron around the sphere."""
        one, two, three = path.tip
        return polyhedron(one, two, third_derivatives(path.s, two, three), self.limit.item())

    def share(self, path: PathDerivatives, motion: Motion) -> Floats:
        """Return the shares (n, 1), none where the motion's jerk is not known."""
        if motion.jerk is None:
            return np.zeros((len(path.s), 1))
        return np.linalg.norm(motion.jerk_of(path.tip), axis=1, keepdims=True) / self.limit

    def measured(self, setpoints: InterpolatedSetpoints) -> Floats:
        """Return the jerks (intervals, 1)."""
        return setpoints.tip.jerk_lengths[setpoints.own_intervals, None]
