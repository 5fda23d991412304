"""Limit of the tip's acceleration: |T′ s̈ + T″ ṡ²| ≤ a."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.limits.limit import Reserve
from pentapod.timing.limits.polytopes import VectorAcceleration
from pentapod.timing.path.path import PathDerivatives
from pentapod.timing.path.setpoints import InterpolatedSetpoints


@dataclass(frozen=True, eq=False)
class TipAcceleration(VectorAcceleration):
    """limit, bound (1,) m/s²."""

    quantity = "tip acceleration"
    unit = "m/s²"

    @classmethod
    def of(cls, machine: Machine, reserve: Reserve) -> TipAcceleration | None:
        """Return the machine's limit, None where it sets none."""
        return cls.if_set(machine.tool_limits.max_tip_acceleration, reserve)

    def vectors(self, path: PathDerivatives) -> tuple[Floats, ...]:
        """Return T′ and T″."""
        return path.tip

    def measured(self, setpoints: InterpolatedSetpoints) -> Floats:
        """Return the accelerations (rows, 1)."""
        return np.linalg.norm(setpoints.tip.second[setpoints.own_rows], axis=1, keepdims=True)
