"""Limit of the legs' accelerations: |q′ s̈ + q″ ṡ²| ≤ a.

A law with bounded jerk cannot push a leg harder than its velocities allow, whatever its acceleration limit is: a leg
that accelerates by α with jerks up to J has changed its velocity by α² / 2J on either side of that moment, within
α / J. So α ≤ √(J Δv), where Δv is the spread of the velocities that the speed limits leave it within that reach. No law
within the jerk limits is lost by this cap; and above it a looser acceleration limit changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.limits.leg_jerk import LegJerk
from pentapod.timing.limits.limit import AccelerationRows, MachineLimit, Motion, Reserve
from pentapod.timing.limits.polytopes import common_push
from pentapod.timing.path.path import PathDerivatives
from pentapod.timing.path.setpoints import InterpolatedSetpoints

_ROUNDS = 2
_MOST_CELLS = 400_000
_LEAST_CAP = 1e-3
"""Share of an acceleration limit below which there is no cap: a leg that rests at gridpoints may move between them."""


@dataclass(frozen=True, eq=False)
class LegAcceleration(MachineLimit):
    """limit, bound (legs,) m/s²; jerk (legs,) m/s³: the limit of jerks that is planned with."""

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
        return common_push(path.legs[0], path.legs[1], size=self.limit)

    def caps(self, path: PathDerivatives, ceiling: Floats, *, moving: bool) -> Floats:
        """Return shares (n, legs) of the limit that no law within the jerk limits exceeds."""
        caps = _acceleration_caps(path.s, path.legs[0], ceiling, self.limit, self.jerk, moving=moving)
        return caps / self.limit

    def share(self, path: PathDerivatives, motion: Motion) -> Floats:
        """Return the shares (n, legs)."""
        return np.abs(path.legs[0] * motion.u[:, None] + path.legs[1] * motion.x[:, None]) / self.limit

    def measured(self, joined: InterpolatedSetpoints) -> Floats:
        """Return the accelerations (rows, legs)."""
        return joined.legs.accelerations[joined.own_rows]


def _acceleration_caps(
    s: Floats, one: Floats, ceiling: Floats, acceleration: Floats, jerk: Floats, *, moving: bool
) -> Floats:
    """Return accelerations (N + 1, R), at most those given (R,), that a law within the jerks (R,) does not exceed.

    one (N + 1, R): the legs' derivatives by s; ceiling (N + 1,): bounds of ṡ². moving: whether the path goes on beyond
    an end, where only what is on one side of a moment counts.
    """
    velocities = one * np.sqrt(ceiling)[:, None]
    sides = 2.0 if moving else 1.0
    caps = np.broadcast_to(acceleration, one.shape).astype(np.float64)
    for _ in range(_ROUNDS):  # lower accelerations take less time to reach, in which less else is reached
        reach = float(np.sqrt(ceiling.max()) * (caps / jerk).max())
        caps = np.minimum(caps, np.sqrt(sides * jerk * _spread(s, velocities, reach)))
    return np.maximum(caps, _LEAST_CAP * acceleration)


def _spread(s: Floats, velocities: Floats, reach: float) -> Floats:
    """Return the spread (N + 1, R) of velocities between rest and these, within `reach` metres of each station."""
    length = float(s[-1])
    least = 20 * len(s) + 64
    cells = int(min(max(64.0, 4.0 * np.ceil(length / reach)), least, _MOST_CELLS))
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
