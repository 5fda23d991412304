"""Limit of the legs' accelerations: |q′ s̈ + q″ ṡ²| ≤ a.

A law with bounded jerk cannot accelerate a leg more than its velocities allow, whatever its acceleration limit is: a
leg that accelerates by α with jerks up to J changes its velocity by α² / 2J before and after that moment, within
α / J each. So α ≤ √(J Δv), where Δv is the spread of the velocities that the speed limits allow within that reach. This
cap excludes no law within the jerk limits; above it a looser acceleration limit changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.limits.leg_jerk import LegJerk
from pentapod.timing.limits.limit import AccelerationRows, MachineLimit, Motion, Reserve, acceleration_ceiling
from pentapod.timing.path.path import PathDerivatives
from pentapod.timing.path.setpoints import InterpolatedSetpoints


@dataclass(frozen=True)
class CapOptions:
    """Options of the caps on accelerations."""

    rounds: int = 2
    """Rounds: a lower cap is reached in less time, within which the velocities spread less."""
    least_share: float = 1e-3
    """Least cap as a share of the limit: a leg that rests at the gridpoints may move between them."""
    cells_in_reach: int = 4
    """Cells of the moving maximum within the reach."""
    least_cells: int = 64
    """Cells of the moving maximum at least."""
    most_cells: int = 400_000
    """Cells of the moving maximum at most."""
    cells_per_gridpoint: int = 20
    """Cells of the moving maximum for each gridpoint at most, beside the least."""


DEFAULT_CAPS = CapOptions()


@dataclass(frozen=True, eq=False)
class LegAcceleration(MachineLimit):
    """limit, bound (legs,) m/s²; jerk (legs,) m/s³: the jerk limit that is planned with."""

    quantity = "leg acceleration"
    unit = "m/s²"
    group = "acceleration"
    of_legs = True

    jerk: Floats

    @classmethod
    def of(cls, machine: Machine, reserve: Reserve) -> LegAcceleration:
        """Return the machine's limit."""
        legs = machine.legs
        return cls(legs.max_acceleration * reserve.softer, legs.max_acceleration, LegJerk.of(machine, reserve).limit)

    def acceleration_rows(self, path: PathDerivatives) -> AccelerationRows:
        """Return the rows (n, legs)."""
        return AccelerationRows.of(path.legs[0] / self.limit, path.legs[1] / self.limit)

    def ceiling(self, path: PathDerivatives) -> Floats:
        """Return the largest x (n,) for which one u suits all legs."""
        return acceleration_ceiling(path.legs[0], path.legs[1], size=self.limit)

    def caps(
        self, path: PathDerivatives, ceiling: Floats, *, moving: bool, options: CapOptions = DEFAULT_CAPS
    ) -> Floats:
        """Return shares (n, legs) of the limit that no law within the jerk limits exceeds.

        ceiling (n,): bounds of ṡ². moving: the path continues beyond an end, where only one side of a moment counts.
        """
        velocities = path.legs[0] * np.sqrt(ceiling)[:, None]
        sides = 2.0 if moving else 1.0
        caps = np.broadcast_to(self.limit, velocities.shape).astype(np.float64)
        for _ in range(options.rounds):
            reach = float(np.sqrt(ceiling.max()) * (caps / self.jerk).max())
            caps = np.minimum(caps, np.sqrt(sides * self.jerk * _spread(path.s, velocities, reach, options)))
        return np.maximum(caps, options.least_share * self.limit) / self.limit

    def share(self, path: PathDerivatives, motion: Motion) -> Floats:
        """Return the shares (n, legs)."""
        return np.abs(path.legs[0] * motion.u[:, None] + path.legs[1] * motion.x[:, None]) / self.limit

    def measured(self, setpoints: InterpolatedSetpoints) -> Floats:
        """Return the accelerations (rows, legs)."""
        return setpoints.legs.accelerations[setpoints.own_rows]


def _spread(s: Floats, velocities: Floats, reach: float, options: CapOptions) -> Floats:
    """Return the spread (N + 1, R) of velocities between rest and these, within `reach` metres of each station."""
    length = float(s[-1])
    most = min(options.cells_per_gridpoint * len(s) + options.least_cells, options.most_cells)
    cells = int(min(max(options.least_cells, options.cells_in_reach * np.ceil(length / reach)), most))
    cell = np.minimum((s * (cells / length)).astype(np.intp), cells - 1)
    middles = (np.arange(cells) + 0.5) * (length / cells)
    width = 2 * int(min(np.ceil(reach * cells / length) + 1.0, cells)) + 1
    spread = np.empty_like(velocities)
    for leg, velocity in enumerate(velocities.T):
        total = np.zeros(len(s))
        for speed in (np.maximum(velocity, 0.0), np.maximum(-velocity, 0.0)):
            most = np.interp(middles, s, speed)
            np.maximum.at(most, cell, speed)
            total += maximum_filter1d(most, width, mode="nearest")[cell]
        spread[:, leg] = np.maximum(total, np.finfo(float).tiny)
    return spread
