"""Limit of the tool axis's angular acceleration: |a × a′ s̈ + a × a″ ṡ²| ≤ a."""

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
class AxisAcceleration(MachineLimit):
    """limit, bound (1,) rad/s²."""

    quantity = "axis acceleration"
    unit = "rad/s²"
    group = "acceleration"
    of_tool = True

    @classmethod
    def of(cls, machine: Machine, reserve: Reserve) -> AxisAcceleration | None:
        """Return the machine's limit, None where it sets none."""
        bound = np.atleast_1d(machine.tool_limits.max_axis_acceleration)
        return cls(bound * reserve.softer, bound) if np.isfinite(bound).all() else None

    def acceleration_rows(self, path: PathDerivatives) -> AccelerationRows:
        """Return the rows of a polygon inside the circle."""
        return AccelerationRows.of(*polygon(path.turn[0], path.turn[1], self.limit.item()))

    def ceiling(self, path: PathDerivatives) -> Floats:
        """Return the largest x (n,) by what is across the turn."""
        with np.errstate(divide="ignore"):
            return self.limit / across_path(path.turn[0], path.turn[1])

    def share(self, path: PathDerivatives, motion: Motion) -> Floats:
        """Return the shares (n, 1)."""
        pushes = path.turn[0] * motion.u[:, None] + path.turn[1] * motion.x[:, None]
        return np.linalg.norm(pushes, axis=1, keepdims=True) / self.limit

    def measured(self, joined: InterpolatedSetpoints) -> Floats:
        """Return the angular accelerations (rows, 1)."""
        return joined.axis.turn_accelerations[joined.own_rows, None]
