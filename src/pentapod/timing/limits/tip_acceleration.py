"""Limit of the tip's acceleration: |T′ s̈ + T″ ṡ²| ≤ a."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.limits.limit import AccelerationRows, MachineLimit, Motion, Reserve
from pentapod.timing.limits.polytopes import across_path, polygon
from pentapod.timing.path.path import PathDerivatives
from pentapod.timing.path.setpoints import InterpolatedSetpoints


@dataclass(frozen=True, eq=False)
class TipAcceleration(MachineLimit):
    """limit, bound (1,) m/s²."""

    quantity = "tip acceleration"
    unit = "m/s²"
    group = "acceleration"
    of_tool = True

    @classmethod
    def of(cls, machine: Machine, reserve: Reserve) -> TipAcceleration | None:
        """Return the machine's limit, None where it sets none."""
        bound = np.atleast_1d(machine.tool_limits.max_tip_acceleration)
        return cls(bound * reserve.softer, bound) if np.isfinite(bound).all() else None

    def acceleration_rows(self, path: PathDerivatives) -> AccelerationRows:
        """Return the rows of a polygon inside the circle."""
        return AccelerationRows.of(*polygon(path.tip[0], path.tip[1], self.limit.item()))

    def ceiling(self, path: PathDerivatives) -> Floats:
        """Return the largest x (n,) by what is across the path."""
        with np.errstate(divide="ignore"):
            return self.limit / across_path(path.tip[0], path.tip[1])

    def share(self, path: PathDerivatives, motion: Motion) -> Floats:
        """Return the shares (n, 1)."""
        pushes = path.tip[0] * motion.u[:, None] + path.tip[1] * motion.x[:, None]
        return np.linalg.norm(pushes, axis=1, keepdims=True) / self.limit

    def measured(self, joined: InterpolatedSetpoints) -> Floats:
        """Return the accelerations (rows, 1)."""
        return np.linalg.norm(joined.tip.second[joined.own_rows], axis=1, keepdims=True)
