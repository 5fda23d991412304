"""The limits of a plan: those that the machine sets, those added to them, and the rows of all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, row_maxima
from pentapod.base.registry import Registry
from pentapod.machine.machine import Machine
from pentapod.machine.rounding import jerk_of_rounding
from pentapod.timing.limits.axis_acceleration import AxisAcceleration
from pentapod.timing.limits.axis_velocity import AxisVelocity
from pentapod.timing.limits.feed import Feed
from pentapod.timing.limits.leg_acceleration import LegAcceleration
from pentapod.timing.limits.leg_force import LegForce
from pentapod.timing.limits.leg_jerk import LegJerk
from pentapod.timing.limits.leg_velocity import LegVelocity
from pentapod.timing.limits.limit import (
    NO_RESERVE,
    AccelerationRows,
    Group,
    Limit,
    MachineLimit,
    Motion,
    Reserve,
)
from pentapod.timing.limits.rapid_rate import RapidRate
from pentapod.timing.limits.tip_acceleration import TipAcceleration
from pentapod.timing.limits.tip_jerk import TipJerk
from pentapod.timing.path.path import PathDerivatives

LIMITS: tuple[type[MachineLimit], ...] = (
    LegVelocity,
    LegAcceleration,
    LegJerk,
    Feed,
    RapidRate,
    TipAcceleration,
    TipJerk,
    AxisVelocity,
    AxisAcceleration,
    LegForce,
)
"""Every limit that a machine or a path sets, in the order of rows and certificates; a new one is added here."""

PLUGGED: Registry[type] = Registry("limit", "pentapod.timing_limits", type)
"""Limits of other packages, by entry points of this group: classes like those of `LIMITS`.

They hold where a job names them (`[limits] use`), or `retime(limits=...)` is given one.
"""


def machine_limits(machine: Machine, reserve: Reserve = NO_RESERVE) -> tuple[Limit, ...]:
    """Return the limits that a machine sets, less a reserve."""
    found = (limit.of(machine, reserve) for limit in LIMITS)
    return tuple(limit for limit in found if limit is not None)


@dataclass(frozen=True, eq=False)
class Limits:
    """The limits that a plan keeps, less the reserve: those of the machine, and those added.

    period: seconds between setpoints.
    """

    of_machine: tuple[Limit, ...]
    added: tuple[Limit, ...]
    feed: Feed
    reserve: Reserve
    period: float

    @classmethod
    def of(
        cls,
        machine: Machine,
        velocity_margin: float,
        acceleration_margin: float,
        guard: float,
        added: Sequence[Limit] = (),
    ) -> Limits:
        """Return the machine's limits and those added, less the margins (fractions); guard: as in `Reserve`."""
        controller = machine.controller
        rounding = jerk_of_rounding(controller.period, controller.interpolation)
        reserve = Reserve(velocity_margin, acceleration_margin, rounding=rounding, guard=guard)
        own = machine_limits(machine, reserve)
        return cls(own, tuple(added), Feed.of(machine, reserve), reserve, controller.period)

    @property
    def all(self) -> tuple[Limit, ...]:
        """The machine's limits, and those added."""
        return (*self.of_machine, *self.added)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns of `shares`."""
        return tuple(name for limit in self.all for name in limit.names)

    @property
    def of_tool(self) -> bool:
        """Whether a limit needs tip or axis of the setpoints."""
        return any(limit.of_tool for limit in self.all)

    def rows(self, path: PathDerivatives) -> AccelerationRows:
        """Return the rows of u and x (n, R) of all limits."""
        parts = [rows for _, rows in self._rows(path)]
        offsets = [rows.offset for rows in parts]
        if max(len(offset) for offset in offsets) > 1:
            offsets = [np.broadcast_to(rows.offset, rows.first.shape) for rows in parts]
        return AccelerationRows(
            np.concatenate([rows.first for rows in parts], axis=1),
            np.concatenate([rows.second for rows in parts], axis=1),
            np.concatenate(offsets, axis=1),
        )

    def row_names(self, path: PathDerivatives) -> tuple[str, ...]:
        """Return the name of the limit to which each row of `rows` belongs."""
        names: list[str] = []
        for limit, rows in self._rows(path):
            times, rest = divmod(rows.first.shape[1], len(limit.names))
            names += limit.names[:1] * rows.first.shape[1] if rest else limit.names * times
        return tuple(names)

    def at_rest(self, path: PathDerivatives, index: int, row: int) -> str:
        """Return in words by how much one of `rows` is exceeded at rest, at one of the path's stations."""
        for limit, rows in self._rows(path):
            if row < rows.first.shape[1]:
                return limit.at_rest(path, index, row)
            row -= rows.first.shape[1]
        return ""

    def jerk_rows(self, path: PathDerivatives) -> Floats:
        """Return the jerks' rows (n, K, 3) of x, x′, x″, by √x."""
        parts = [rows for limit in self.of_machine if (rows := limit.jerk_rows(path)) is not None]
        parts += [rows / self.reserve.smoother for limit in self.added if (rows := limit.jerk_rows(path)) is not None]
        return np.concatenate(parts, axis=1) if len(parts) > 1 else parts[0]

    def ceiling(self, path: PathDerivatives) -> Floats:
        """Return the largest x (n,) that every limit allows by itself, with the best u."""
        own = [limit.ceiling(path) for limit in self.of_machine]
        return np.min([*own, *(limit.ceiling(path) * self.reserve.x(limit.group) for limit in self.added)], axis=0)

    def slowness(self, path: PathDerivatives) -> Floats:
        """Return 1/ṡ (n,) in s/m at the lowest of the speed limits that vary within a section."""
        unit = Motion.of(np.ones(len(path.s)), np.zeros(len(path.s)))
        speeds = (limit for limit in self.all if limit.group == "speed" and not limit.sectional)
        return np.max([row_maxima(self._share(limit, path, unit)) for limit in speeds], axis=0)

    def caps(self, path: PathDerivatives, ceiling: Floats, *, moving: bool) -> Floats:
        """Return shares (n, R) of the rows' limits that no law within the jerk limits exceeds."""
        parts = [
            limit.caps(path, ceiling, moving=moving) if isinstance(limit, LegAcceleration) else np.ones_like(rows.first)
            for limit, rows in self._rows(path)
        ]
        return np.concatenate(parts, axis=1)

    def shares(self, path: PathDerivatives, motion: Motion) -> Floats:
        """Return the share (n, C) of each limit that a motion uses, in the order of `names`."""
        return np.concatenate([self._share(limit, path, motion) for limit in self.all], axis=1)

    def largest(self, group: Group, path: PathDerivatives, motion: Motion) -> Floats:
        """Return the largest share (n,) of the limits of one group."""
        found = [row_maxima(self._share(limit, path, motion)) for limit in self.all if limit.group == group]
        return np.max(found, axis=0)

    def _rows(self, path: PathDerivatives) -> list[tuple[Limit, AccelerationRows]]:
        found = [(limit, limit.acceleration_rows(path)) for limit in self.of_machine]
        for limit in self.added:
            rows = limit.acceleration_rows(path)
            found.append((limit, None if rows is None else rows.over(self.reserve.softer)))
        return [(limit, rows) for limit, rows in found if rows is not None]

    def _share(self, limit: Limit, path: PathDerivatives, motion: Motion) -> Floats:
        share = limit.share(path, motion)
        return share / self.reserve.kept(limit.group) if any(limit is one for one in self.added) else share
