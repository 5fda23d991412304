"""Limit of the tip speed: the rapid rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.limits.limit import MachineLimit, Reserve
from pentapod.timing.path.path import PathDerivatives
from pentapod.timing.path.setpoints import InterpolatedSetpoints


@dataclass(frozen=True, eq=False)
class RapidRate(MachineLimit):
    """limit, bound (1,) m/s."""

    quantity = "rapid rate"
    unit = "m/s"
    group = "speed"
    sectional = True

    @classmethod
    def of(cls, machine: Machine, reserve: Reserve) -> RapidRate:
        """Return the machine's limit."""
        limit = np.atleast_1d(machine.rapid_velocity * reserve.slower)
        return cls(limit, limit / reserve.slower)

    def speed_rows(self, path: PathDerivatives) -> Floats:
        """Return the largest ṡ (n, 1): the tip is never faster than s."""
        return np.broadcast_to(self.limit, (len(path.s), 1))

    def measured(self, setpoints: InterpolatedSetpoints) -> Floats:
        """Return the largest rates (intervals, 1) of the station."""
        return setpoints.station.rates[setpoints.own_intervals]

    def largest(self, setpoints: InterpolatedSetpoints) -> None:
        """Return None: certificates judge it with the feed."""
        return
