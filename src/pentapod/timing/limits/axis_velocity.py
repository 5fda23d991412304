"""Limit of the tool axis's angular velocity: |a × a′| ṡ ≤ v."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.interpolant import largest_length
from pentapod.machine.machine import Machine
from pentapod.timing.limits.limit import MachineLimit, Motion, Reading, Reserve
from pentapod.timing.path.path import PathDerivatives
from pentapod.timing.path.setpoints import InterpolatedSetpoints


@dataclass(frozen=True, eq=False)
class AxisVelocity(MachineLimit):
    """limit, bound (1,) rad/s."""

    quantity = "axis velocity"
    unit = "rad/s"
    group = "speed"
    of_tool = True

    @classmethod
    def of(cls, machine: Machine, reserve: Reserve) -> AxisVelocity | None:
        """Return the machine's limit, None where it sets none."""
        return cls.if_set(machine.tool_limits.max_axis_velocity, reserve)

    def speed_rows(self, path: PathDerivatives) -> Floats:
        """Return the largest ṡ (n, 1)."""
        with np.errstate(divide="ignore"):
            return self.limit / np.linalg.norm(path.turn[0], axis=1, keepdims=True)

    def share(self, path: PathDerivatives, motion: Motion) -> Floats:
        """Return the shares (n, 1)."""
        return np.linalg.norm(path.turn[0], axis=1, keepdims=True) * motion.v[:, None] / self.limit

    def measured(self, setpoints: InterpolatedSetpoints) -> Floats:
        """Return bounds of the rates (intervals, 1), by the hull of the polynomials' coefficients."""
        return np.linalg.norm(setpoints.axis.steps[setpoints.own_intervals], axis=1).max(axis=1, keepdims=True)

    def largest(self, setpoints: InterpolatedSetpoints) -> Reading:
        """Return the largest rate, exactly."""
        value, row = largest_length(setpoints.axis.steps[setpoints.own_intervals])
        return Reading(value, self.bound.item(), row, 0)
