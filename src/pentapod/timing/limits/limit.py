"""Limit: a constraint on the motion along a path, as rows that are linear in ṡ² and s̈.

With x = ṡ² and u = s̈, a leg moves at q′ √x and accelerates with q′ u + q″ x; a force in a leg has an offset beside
that, which is there at rest as well. A limit of one's own is a class with `names` and one of the three kinds of rows:
`retime` takes it in `limits`, and everything else follows from the rows.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, Protocol

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.timing.limits.polytopes import common_push
from pentapod.timing.path.path import PathDerivatives
from pentapod.timing.path.setpoints import InterpolatedSetpoints

if TYPE_CHECKING:
    from pentapod.machine.machine import Machine

Group = Literal["speed", "acceleration", "jerk"]
"""What a limit is exceeded by: a motion run slower by the factor f uses less by f, f² or f³."""


@dataclass(frozen=True)
class Reserve:
    """What a plan leaves free of each limit.

    velocity, acceleration: fractions of speeds, and of accelerations and jerks. ringing: share of a jerk limit that is
    planned with, for where jerk steps the spline through setpoints rings above it. rounding: m/s³, the jerk that
    rounding setpoints may add to a leg's; least_left: share of a jerk limit that is left for the plan at least, however
    much that is. guard: seconds by which a slower section's feed reaches into its faster neighbours, so that no
    interval between two setpoints straddles the step too fast.
    """

    velocity: float = 0.0
    acceleration: float = 0.0
    ringing: float = 1.0
    rounding: float = 0.0
    least_left: float = 0.25
    guard: float = 0.0

    @property
    def slower(self) -> float:
        """Share of speeds that is planned with."""
        return 1.0 - self.velocity

    @property
    def softer(self) -> float:
        """Share of accelerations that is planned with."""
        return 1.0 - self.acceleration

    @property
    def smoother(self) -> float:
        """Share of what rounding leaves of jerks that is planned with."""
        return self.softer * self.ringing

    def kept(self, group: Group) -> float:
        """Return the share of a limit that is planned with."""
        return {"speed": self.slower, "acceleration": self.softer, "jerk": self.smoother}[group]

    def x(self, group: Group) -> float:
        """Return the share of the largest ṡ² that is planned with, by a limit alone."""
        return self.slower**2 if group == "speed" else self.softer

    def jerk(self, limit: Floats | float, rounded: float = 1.0) -> Floats:
        """Return what rounding, `rounded` times that of a leg, leaves of a jerk limit."""
        return np.maximum(np.asarray(limit) - rounded * self.rounding, self.least_left * np.asarray(limit))


NOTHING_LEFT_FREE = Reserve()


@dataclass(frozen=True, eq=False)
class AccelerationRows(Value):
    """|first u + second x + offset| ≤ 1: first, second (n, R); offset (n, R), or zeros (1, R) where there is none."""

    first: Floats
    second: Floats
    offset: Floats

    @classmethod
    def of(cls, first: Floats, second: Floats) -> AccelerationRows:
        """Return rows without an offset."""
        return cls(first, second, np.zeros((1, first.shape[1])))

    def over(self, share: Floats | float) -> AccelerationRows:
        """Return the rows of a limit of which the motion may use a share (n, R) or (n, 1): the offset stays."""
        return AccelerationRows(self.first / share, self.second / share, self.offset)


def share_of_room(pushes: Floats, offset: Floats) -> Floats:
    """Return which share (n, R) of the room beside the offset |pushes + offset| ≤ 1 leaves the pushes (n, R) take.

    It is 1 where the limit is reached, and grows with the pushes, as the motion alone can change them.
    """
    if not offset.any():
        return np.abs(pushes)
    least = np.finfo(float).tiny
    return np.maximum(pushes / np.maximum(1.0 - offset, least), -pushes / np.maximum(1.0 + offset, least))


@dataclass(frozen=True, eq=False)
class Motion:
    """ṡ² x, ṡ v, s̈ u and, where jerks are asked for, s⃛ jerk (n,) at stations; SI units."""

    x: Floats
    v: Floats
    u: Floats
    jerk: Floats | None = None

    @classmethod
    def of(cls, x: Floats, u: Floats) -> Motion:
        """Return the motion with these squared speeds and accelerations."""
        return cls(x, np.sqrt(x), u)


@dataclass(frozen=True)
class Reading:
    """The largest value of a limit's quantity and its bound, in which row (from the first) and for which name."""

    value: float
    bound: float
    row: int
    index: int


@dataclass(frozen=True)
class Constraint:
    """A limit's name, and how a sentence calls it: "leg 1 jerk", "leg 1's jerk"."""

    name: str
    subject: str


class Limit(Protocol):
    """One limit. A subclass gives `names` and at least one kind of rows; the other methods have defaults made of them.

    quantity: its name in certificates; unit: of the values told there, SI. of_legs: one name for each leg.
    of_tool: it asks for tip or axis of the setpoints. sectional: it is the same between two marks of the path (feeds),
    so that nothing is to be looked for between gridpoints. above: why a value may exceed its bound by little.
    """

    quantity: ClassVar[str]
    unit: ClassVar[str] = "of the limit"
    group: ClassVar[Group]
    of_legs: ClassVar[bool] = False
    of_tool: ClassVar[bool] = False
    sectional: ClassVar[bool] = False
    above: ClassVar[str] = ""

    @property
    def names(self) -> tuple[str, ...]:
        """What is told of the limit, one name for each leg or one for all: "leg 1 velocity"."""
        ...

    def explain(self, index: int) -> str:
        """Return the name with this index as the subject of a sentence: "leg 1's velocity"."""
        return self.names[index]

    @property
    def bounds(self) -> Floats:
        """What `measured` must not exceed: one for each name, or one for all."""
        return np.ones(1)

    def speed_rows(self, path: PathDerivatives) -> Floats | None:
        """Return the largest ṡ (n, R), m/s, by each row."""
        return None

    def acceleration_rows(self, path: PathDerivatives) -> AccelerationRows | None:
        """Return the rows (n, R) of u and x."""
        return None

    def jerk_rows(self, path: PathDerivatives) -> Floats | None:
        """Return rows (n, K, 3) with |row · (x, x′, x″)| √x ≤ 1, x′ and x″ by s; path has derivatives up to order 3."""
        return None

    def ceiling(self, path: PathDerivatives) -> Floats:
        """Return the largest x (n,) that this limit allows with the best u."""
        speeds, rows = self.speed_rows(path), self.acceleration_rows(path)
        x = np.full(len(path.s), np.inf) if speeds is None else np.square(speeds).min(axis=1)
        return x if rows is None else np.minimum(x, common_push(rows.first, rows.second, rows.offset))

    def share(self, path: PathDerivatives, motion: Motion) -> Floats:
        """Return how much of the limit a motion uses (n, names), beside what it uses at rest (`share_of_room`)."""
        speeds, rows = self.speed_rows(path), self.acceleration_rows(path)
        shares: list[Floats] = [] if speeds is None else [motion.v[:, None] / speeds]
        if rows is not None:
            pushes = rows.first * motion.u[:, None] + rows.second * motion.x[:, None]
            shares.append(share_of_room(pushes, rows.offset))
        if motion.jerk is not None and (jerks := self.jerk_rows(path)) is not None:
            v, u = motion.v, motion.u
            shares.append(np.abs(jerks @ np.stack([v**3, 2.0 * v * u, 2.0 * motion.jerk], axis=1)[:, :, None])[:, :, 0])
        one_each = (y if y.shape[1] == len(self.names) else y.max(axis=1, keepdims=True) for y in shares)
        return np.max([np.zeros((len(path.s), len(self.names))), *one_each], axis=0)

    def measured(self, joined: InterpolatedSetpoints) -> Floats:
        """Return the quantity (rows or intervals, names) of setpoints as the controller joins them.

        By default the share, at their stations.
        """
        rows, station = joined.own_rows, joined.station
        v, u = station.first[:, 0], station.second[rows, 0]
        if joined.interpolation == "linear":  # the rate jumps at the row: the mean of both sides
            v = 0.5 * (v + np.append(v[1:], 0.0))
        v = v[rows]
        jerk = np.gradient(station.second[:, 0], joined.period)[rows] if self.group == "jerk" else None
        path = PathDerivatives(joined.piece, joined.rows.stations[rows], 2 if jerk is None else 3)
        return self.share(path, Motion(v * v, v, u, jerk))

    def used(self, joined: InterpolatedSetpoints) -> Floats:
        """Return the largest share (rows or intervals,) that setpoints use."""
        return (self.measured(joined) / self.bounds).max(axis=1)

    def largest(self, joined: InterpolatedSetpoints) -> Reading | None:
        """Return the largest share's value and place, None where it is not told in certificates."""
        values = self.measured(joined)
        row, index = np.unravel_index(int(np.argmax(values / self.bounds)), values.shape)
        bound = np.broadcast_to(self.bounds, values.shape[1])[index]
        return Reading(float(values[row, index]), float(bound), int(row), int(index))


@dataclass(frozen=True, eq=False)
class MachineLimit(Limit):
    """A limit that machines set, one of `LIMITS`, in SI units, one number for each name.

    limit: what is planned with; bound: what setpoints must keep.
    """

    limit: Floats
    bound: Floats

    @classmethod
    @abstractmethod
    def of(cls, machine: Machine, reserve: Reserve) -> MachineLimit | None:
        """Return the machine's limit, of which the plan leaves a reserve free; None where it sets none."""

    @property
    def names(self) -> tuple[str, ...]:
        """The quantity, for each leg where it is the legs': "leg 1 velocity"."""
        if not self.of_legs:
            return (self.quantity,)
        return tuple(f"leg {leg}{self.quantity.removeprefix('leg')}" for leg in range(1, len(self.limit) + 1))

    def explain(self, index: int) -> str:
        """Return "leg 1's velocity", or the quantity."""
        return f"leg {index + 1}'s{self.quantity.removeprefix('leg')}" if self.of_legs else self.quantity

    @property
    def bounds(self) -> Floats:
        """What setpoints must keep."""
        return self.bound
