"""Limit: a constraint on the motion along a path, as rows that are linear in ṡ² and s̈.

With x = ṡ² and u = s̈, a leg moves at q′ √x and accelerates with q′ u + q″ x; the force in a leg has an offset too,
which is present at rest as well. A further limit is a class with `names` and one of the three kinds of rows: `retime`
takes it in `limits`, and everything else follows from the rows.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, Protocol, Self

import numpy as np

from pentapod.base.arrays import Floats, row_maxima, row_minima
from pentapod.base.values import Value
from pentapod.timing.path.path import PathDerivatives
from pentapod.timing.path.setpoints import InterpolatedSetpoints

if TYPE_CHECKING:
    from pentapod.machine.machine import Machine

Group = Literal["speed", "acceleration", "jerk"]
"""What is limited: a motion run slower by the factor f uses less of it by f, f² or f³."""


@dataclass(frozen=True)
class Reserve:
    """Reserve of a plan: how much of each limit it leaves free."""

    velocity: float = 0.0
    """Fraction of speeds that is left free."""
    acceleration: float = 0.0
    """Fraction of accelerations and jerks that is left free."""
    ringing: float = 0.975
    """Share of a jerk limit that is planned with: where jerk steps, the spline through the setpoints overshoots."""
    rounding: float = 0.0
    """Jerk in m/s³ that the rounding of setpoints may add to a leg's."""
    least_left: float = 0.25
    """Share of a jerk limit that is planned with at least, however much rounding takes."""
    guard: float = 0.0
    """Seconds by which a slower section's feed extends into its faster neighbours, so that no interval between two
    setpoints crosses the step too fast."""

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


NO_RESERVE = Reserve(ringing=1.0)


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
        """Return the rows where the motion may use a share (n, R) or (n, 1) of the limit; the offset stays."""
        return AccelerationRows(self.first / share, self.second / share, self.offset)


def acceleration_ceiling(
    first: Floats, second: Floats, offset: Floats | None = None, size: Floats | float = 1.0
) -> Floats:
    """Return the largest x (n,) for which one u keeps all |first u + second x + offset| ≤ size.

    first, second, offset (n, R); size (R,). Each row is a strip in the (u, x) plane: at one x it allows an interval of
    u, and intervals have a common point if each two of them have. Hence the minimum over pairs of rows of
    (size_i |first_j| + size_j |first_i|) / |second_i first_j − second_j first_i| where there is no offset.
    """
    from pentapod.timing.limits.ceiling_kernels import largest_x  # noqa: PLC0415 - loads numba

    size, x = np.array(np.broadcast_to(size, first.shape[1]), dtype=np.float64), np.empty(len(first))
    offset = np.zeros((1, first.shape[1])) if offset is None else offset
    first, second, offset = (np.require(y, np.float64, ["C", "W"]) for y in (first, second, offset))
    largest_x(first, second, offset, int(len(offset) > 1), size, x)
    return x


def share_of_room(pushes: Floats, offset: Floats) -> Floats:
    """Return the share (n, R) that pushes (n, R) use of what the offset leaves them of |pushes + offset| ≤ 1.

    It is 1 at the limit and proportional to the pushes, since the motion cannot change the offset.
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

    def jerk_of(self, derivatives: tuple[Floats, ...]) -> Floats:
        """Return the jerk (n, d) of a quantity with these derivatives (n, d) by s, order 1 to 3."""
        (one, two, three), v, a = derivatives, self.v[:, None], self.u[:, None]
        return one * np.asarray(self.jerk)[:, None] + 3.0 * two * v * a + three * v**3


@dataclass(frozen=True)
class Reading:
    """The largest value of a limit's quantity and its bound, in which row (from the first) and for which name."""

    value: float
    bound: float
    row: int
    index: int


class Limit(Protocol):
    """One limit: a subclass defines `names` and at least one kind of rows; the other methods default to these.

    quantity: its name in certificates; unit: SI, of the values there. of_legs: one name for each leg.
    of_tool: it needs tip or axis of the setpoints. of_path: it is judged piece by piece. sectional: it is constant
    between two marks of the path (feeds), so that nothing needs to be checked between gridpoints. above: why a value
    may slightly exceed its bound.
    """

    quantity: ClassVar[str]
    unit: ClassVar[str] = "of the limit"
    group: ClassVar[Group]
    of_legs: ClassVar[bool] = False
    of_tool: ClassVar[bool] = False
    of_path: ClassVar[bool] = False
    sectional: ClassVar[bool] = False
    above: ClassVar[str] = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Names in messages, one for each leg or one for all: "leg 1 velocity"."""
        ...

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
        x = np.full(len(path.s), np.inf) if speeds is None else row_minima(np.square(speeds))
        return x if rows is None else np.minimum(x, acceleration_ceiling(rows.first, rows.second, rows.offset))

    def share(self, path: PathDerivatives, motion: Motion) -> Floats:
        """Return the share (n, names) of the limit that a motion uses, beside what is used at rest."""
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

    def at_rest(self, path: PathDerivatives, index: int, row: int) -> str:
        """Return in words by how much one of `acceleration_rows` is exceeded at rest, at one of the path's stations."""
        rows = self.acceleration_rows(path)
        return "" if rows is None else f"{abs(rows.offset[index, row]):.3g} times the limit"

    def measured(self, setpoints: InterpolatedSetpoints) -> Floats:
        """Return the quantity (rows or intervals, names) of interpolated setpoints; by default the share there."""
        rows, station = setpoints.own_rows, setpoints.station
        v, u = station.first[:, 0], station.second[rows, 0]
        if setpoints.interpolation == "linear":  # the rate jumps at the row: the mean of both sides
            v = 0.5 * (v + np.append(v[1:], 0.0))
        v = v[rows]
        jerk = np.gradient(station.second[:, 0], setpoints.period)[rows] if self.group == "jerk" else None
        path = PathDerivatives(setpoints.piece, setpoints.rows.stations[rows], 2 if jerk is None else 3)
        return self.share(path, Motion(v * v, v, u, jerk))

    def used(self, setpoints: InterpolatedSetpoints) -> Floats:
        """Return the largest share (rows or intervals,) that setpoints use."""
        return row_maxima(self.measured(setpoints) / self.bounds)

    def largest(self, setpoints: InterpolatedSetpoints) -> Reading | None:
        """Return value and place of the largest share, None where certificates do not list the limit."""
        values = self.measured(setpoints)
        row, index = np.unravel_index(int(np.argmax(values / self.bounds)), values.shape)
        bound = np.broadcast_to(self.bounds, values.shape[1])[index]
        return Reading(float(values[row, index]), float(bound), int(row), int(index))


@dataclass(frozen=True, eq=False)
class MachineLimit(Limit):
    """A limit that machines set, one of `LIMITS`, in SI units.

    limit (names,): what is planned with; bound (names,): what setpoints must keep.
    """

    limit: Floats
    bound: Floats

    @classmethod
    @abstractmethod
    def of(cls, machine: Machine, reserve: Reserve) -> MachineLimit | None:
        """Return the machine's limit, of which the plan leaves a reserve free; None where it sets none."""

    @classmethod
    def if_set(cls, bound: float, reserve: Reserve) -> Self | None:
        """Return the limit with one bound, None where that is infinite."""
        bounds = np.atleast_1d(bound)
        return cls(bounds * reserve.kept(cls.group), bounds) if np.isfinite(bound) else None

    @property
    def names(self) -> tuple[str, ...]:
        """The quantity, for each leg where it is the legs': "leg 1 velocity"."""
        if not self.of_legs:
            return (self.quantity,)
        return tuple(f"leg {leg}{self.quantity.removeprefix('leg')}" for leg in range(1, len(self.limit) + 1))

    @property
    def bounds(self) -> Floats:
        """What setpoints must keep."""
        return self.bound
