"""The part of a path that one problem of the jerk passes is about."""

from __future__ import annotations

from dataclasses import dataclass, replace

from pentapod.base.arrays import Floats
from pentapod.timing.jerk.ends import End, Open, Ramp, Steady
from pentapod.timing.jerk.rows import ROW_NAMES, JerkRows, RowsAt


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

    @classmethod
    def of(
        cls, s: Floats, x: Floats, rows_at: RowsAt, marks: Floats, goes_on: tuple[bool, bool], least_step: float
    ) -> Part:
        """Return the part; goes_on: whether the path goes on beyond either end. At rest where x is 0, else steady."""
        rows = rows_at(s)
        turned = JerkRows(*(getattr(rows, name)[::-1] for name in ROW_NAMES))
        begin, end = (
            Open() if on else Ramp.of(there, at, float(s[-1]) / 8.0) if here == 0.0 else Steady(float(here))
            for on, there, at, here in ((goes_on[0], rows, s, x[0]), (goes_on[1], turned, s[::-1], x[-1]))
        )
        inner = marks[(marks > 0.0) & (marks < s[-1])]
        return cls(s, x, rows_at, rows, inner, begin, end, least_step)

    @property
    def length(self) -> float:
        """Metres."""
        return float(self.s[-1])

    def shorter(self) -> Part:
        """Return it with shorter ramps out of its rests."""
        return replace(self, begin=self.begin.shorter(), end=self.end.shorter())
