"""Limit of the tool axis's angular acceleration: |a × a′ s̈ + a × a″ ṡ²| ≤ α."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.limits.limit import Reserve
from pentapod.timing.limits.polytopes import VectorAcceleration
from pentapod.timing.path.path import PathDerivatives
from pentapod.timing.path.setpoints import InterpolatedSetpoints


@dataclass(frozen=True, eq=False)
class AxisAcceleration(VectorAcceleration):
    """limit, bound (1,) rad/s²."""

    quantity = "axis acceleration"
    unit = "rad/s²"

    @classmethod
    def of(cls, machine: Machine, reserve: Reserve) -> AxisAcceleration | None:
        """Return the machine's limit, None where it sets none."""
        return cls.if_set(machine.tool_limits.max_axis_acceleration, reserve)

    def vectors(self, path: PathDerivatives) -> tuple[Floats, ...]:
        """Return a × a′ and a × a″."""
        return path.turn

    def measured(self, setpoints: InterpolatedSetpoints) -> Floats:
        """Return the angular accelerations (rows, 1)."""
        return setpoints.axis.turn_accelerations[setpoints.own_rows, None]
