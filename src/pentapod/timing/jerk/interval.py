"""Interval of a jerk-limited problem and its end conditions: at rest, at a given speed, or open."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.timing.jerk.options import DEFAULTS, JerkOptions, RampOptions
from pentapod.timing.jerk.rows import ROW_NAMES, JerkRows, RowsAt


@dataclass(frozen=True)
class End:
    """Open end: the path goes on beyond it.

    join: distance in metres from the path's end at which the spline begins.
    """

    join: float = 0.0

    def shorter(self, factor: float) -> End:
        """Return the end with a shorter ramp, where it has one."""
        del factor
        return self

    def bound(self, distance: Floats) -> Floats:
        """Return an upper bound of x (n,) at distances (n,) from the path's end."""
        return np.full(len(distance), np.inf)

    def coefficients(self, step: float) -> tuple[float, ...]:
        """Return the outermost coefficients that are given, from the end inwards; step: between the first two knots."""
        del step
        return ()


@dataclass(frozen=True)
class GivenSpeed(End):
    """End with a given speed, x = ṡ², and no acceleration."""

    x: float = 0.0

    def coefficients(self, step: float) -> tuple[float, ...]:
        """Return x with no slope."""
        del step
        return self.x, self.x


@dataclass(frozen=True)
class Ramp(End):
    """Ramp of constant jerk out of a rest: x = c d^(4/3) at the distance d from it."""

    c: float = 0.0

    @classmethod
    def of(cls, rows: JerkRows, s: Floats, options: RampOptions) -> Ramp:
        """Return the ramp at the rest s[0] of rows at s (N,)."""
        jerk = options.jerk_share / float(np.abs(2.0 * rows.jerks[0, :, 2]).max())
        room = 1.0 - np.abs(rows.offset[0])
        push = float((room / np.maximum(np.abs(rows.first[0]), 1e-300)).min())
        c = 6.0 ** (4.0 / 3.0) / 4.0 * jerk ** (2.0 / 3.0)
        # The ramp ends where its acceleration or its speed would reach a limit.
        length = min(push**3 / (6.0 * jerk**2), float(np.abs(s[-1] - s[0])) * options.length_share)
        within = max(int(np.searchsorted(np.abs(s - s[0]), length)), 1)
        length = min(length, (0.5 * float(rows.ceiling[:within].min()) / c) ** 0.75)
        return cls(options.join_share * length, c)

    def shorter(self, factor: float) -> Ramp:
        """Return a shorter ramp: on a path that bends right beside the rest the spline must begin sooner."""
        return replace(self, join=self.join * factor)

    def bound(self, distance: Floats) -> Floats:
        """Return x (n,) of the ramp, continued beyond the join."""
        return self.c * np.maximum(distance, self.join) ** (4.0 / 3.0)

    def coefficients(self, step: float) -> tuple[float, ...]:
        """Return those with the ramp's speed and acceleration where the spline begins."""
        x = self.c * self.join ** (4.0 / 3.0)
        return x, x + 4.0 / 3.0 * self.c * self.join ** (1.0 / 3.0) * step / 3.0


@dataclass(frozen=True, eq=False)
class Interval:
    """An upper bound x (N,) of the law's ṡ² at stations s (N,) from 0 on, with rows, kinks and end conditions.

    rows: at s; kinks: where the path's third derivative jumps; least_step: seconds below which knots are not closer.
    """

    s: Floats
    x: Floats
    rows_at: RowsAt
    rows: JerkRows
    kinks: Floats
    begin: End
    end: End
    least_step: float
    options: JerkOptions = DEFAULTS

    @classmethod
    def of(
        cls,
        s: Floats,
        x: Floats,
        rows_at: RowsAt,
        kinks: Floats,
        open_ends: tuple[bool, bool],
        least_step: float,
        options: JerkOptions = DEFAULTS,
    ) -> Interval:
        """Return the interval; an end that is not open is a rest where x is 0, else it has the speed of x."""
        rows = rows_at(s)
        turned = JerkRows(*(getattr(rows, name)[::-1] for name in ROW_NAMES))
        begin, end = (
            End() if is_open else Ramp.of(there, at, options.ramps) if here == 0.0 else GivenSpeed(x=float(here))
            for is_open, there, at, here in ((open_ends[0], rows, s, x[0]), (open_ends[1], turned, s[::-1], x[-1]))
        )
        inner = kinks[(kinks > 0.0) & (kinks < s[-1])]
        return cls(s, x, rows_at, rows, inner, begin, end, least_step, options)

    @property
    def length(self) -> float:
        """Metres."""
        return float(self.s[-1])

    def shorter_ramps(self) -> Interval:
        """Return the interval with shorter ramps out of its rests."""
        factor = self.options.ramps.shortening
        return replace(self, begin=self.begin.shorter(factor), end=self.end.shorter(factor))
