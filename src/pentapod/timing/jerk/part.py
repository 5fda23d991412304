"""The domain of one jerk problem, a part of the path, and its end conditions: rest, given speed, or open."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.timing.jerk.options import USUAL, JerkOptions
from pentapod.timing.jerk.rows import ROW_NAMES, JerkRows, RowsAt

_JOIN = 0.01
"""Where the spline begins, as a share of the length over which the first ramp would reach another limit."""

_END_JERK = 0.98

_SHORTER = 0.125
"""By how much shorter a ramp is tried where no law was found."""


class End(Protocol):
    """One end of a spline x(s). join: the distance in metres from the path's end at which the spline begins."""

    @property
    def join(self) -> float: ...  # noqa: D102 (described above)
    def shorter(self) -> End:
        """Return the end with a shorter ramp."""
        ...

    def bound(self, distance: Floats) -> Floats:
        """Return what x (n,) may be at most at distances (n,) from the path's end, by what leads to the spline."""
        ...

    def coefficients(self, step: float) -> tuple[float, ...]:
        """Return the outermost coefficients that are given, from the end inwards; step: between the first two knots."""
        ...


@dataclass(frozen=True)
class Ramp:
    """Out of a rest with constant jerk: x = c d^(4/3) at the distance d, the spline from the distance `join` on."""

    c: float
    join: float

    @classmethod
    def of(cls, rows: JerkRows, s: Floats, reach: float) -> Ramp:
        """Return the ramp at the rest s[0] of rows at s, at most `reach` long."""
        jerk = _END_JERK / float(np.abs(2.0 * rows.jerks[0, :, 2]).max())
        room = 1.0 - np.abs(rows.offset[0])
        push = float((room / np.maximum(np.abs(rows.first[0]), 1e-300)).min())
        c = 6.0 ** (4.0 / 3.0) / 4.0 * jerk ** (2.0 / 3.0)
        # Where the acceleration or the speed that the ramp reaches would be a limit's.
        length = min(push**3 / (6.0 * jerk**2), reach)
        within = max(int(np.searchsorted(np.abs(s - s[0]), length)), 1)
        length = min(length, (0.5 * float(rows.ceiling[:within].min()) / c) ** 0.75)
        return cls(c, _JOIN * length)

    def shorter(self) -> Ramp:
        """Return a shorter ramp: on a path that bends hard right beside the rest the spline must begin sooner."""
        return Ramp(self.c, self.join * _SHORTER)

    def bound(self, distance: Floats) -> Floats:
        """Return the ramp's own x (n,), as it would go on."""
        return self.c * np.maximum(distance, self.join) ** (4.0 / 3.0)

    def coefficients(self, step: float) -> tuple[float, ...]:
        """Return those of the ramp's speed and acceleration where the spline begins."""
        x = self.c * self.join ** (4.0 / 3.0)
        return x, x + 4.0 / 3.0 * self.c * self.join ** (1.0 / 3.0) * step / 3.0


@dataclass(frozen=True)
class Steady:
    """At a given speed, x = ṡ², without acceleration."""

    x: float
    join: float = 0.0

    def shorter(self) -> Steady:
        """Return itself: there is no ramp."""
        return self

    def bound(self, distance: Floats) -> Floats:
        """Return no bound (n,)."""
        return np.full(len(distance), np.inf)

    def coefficients(self, step: float) -> tuple[float, ...]:
        """Return x with no slope."""
        del step
        return self.x, self.x


@dataclass(frozen=True)
class Open:
    """Where the path goes on beyond the stretch that is looked at."""

    join: float = 0.0

    def shorter(self) -> Open:
        """Return itself: there is no ramp."""
        return self

    def bound(self, distance: Floats) -> Floats:
        """Return no bound (n,)."""
        return np.full(len(distance), np.inf)

    def coefficients(self, step: float) -> tuple[float, ...]:
        """Return none."""
        del step
        return ()


@dataclass(frozen=True, eq=False)
class Part:
    """A law x (N + 1,) that bounds the one looked for, at s (N + 1,) from 0 on, and what else is known there.

    rows: at s; marks: where the path's third derivative has kinks; begin, end: how the law begins and ends; least_step:
    seconds below which it has no freedom.
    """

    s: Floats
    x: Floats
    rows_at: RowsAt
    rows: JerkRows
    marks: Floats
    begin: End
    end: End
    least_step: float
    options: JerkOptions = USUAL

    @classmethod
    def of(
        cls,
        s: Floats,
        x: Floats,
        rows_at: RowsAt,
        marks: Floats,
        goes_on: tuple[bool, bool],
        least_step: float,
        options: JerkOptions = USUAL,
    ) -> Part:
        """Return the part; goes_on: whether the path goes on beyond either end. At rest where x is 0, else steady."""
        rows = rows_at(s)
        turned = JerkRows(*(getattr(rows, name)[::-1] for name in ROW_NAMES))
        begin, end = (
            Open() if on else Ramp.of(there, at, float(s[-1]) / 8.0) if here == 0.0 else Steady(float(here))
            for on, there, at, here in ((goes_on[0], rows, s, x[0]), (goes_on[1], turned, s[::-1], x[-1]))
        )
        inner = marks[(marks > 0.0) & (marks < s[-1])]
        return cls(s, x, rows_at, rows, inner, begin, end, least_step, options)

    @property
    def length(self) -> float:
        """Metres."""
        return float(self.s[-1])

    def shorter(self) -> Part:
        """Return it with shorter ramps out of its rests."""
        return replace(self, begin=self.begin.shorter(), end=self.end.shorter())
