"""Setpoints of a time law, and the shares of the limits that they use as the controller interpolates them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from pentapod.base.arrays import Floats, Ints, row_maxima
from pentapod.machine.machine import Machine
from pentapod.numerics.blocks import blocks
from pentapod.numerics.threads import in_threads, on_all_cores
from pentapod.timing.limits.limit import Group
from pentapod.timing.path.setpoints import InterpolatedSetpoints, SetpointRows, spline_padding
from pentapod.timing.pieces.piece import PieceProfile
from pentapod.timing.time_law.motion_law import MotionLaw

GOAL = 0.999
"""Share of each limit that setpoints may use."""

EDGE = 32
"""Rows beyond which a row has no influence on the spline through all rows: it falls by the factor 0.27 with each."""

ROWS_AT_ONCE = 1 << 16
"""Rows measured together, so that memory grows by no more than four numbers a row."""


@dataclass(frozen=True, eq=False)
class LimitShares:
    """Shares (rows,) of the limits around the setpoints of a piece: of speeds, of accelerations, of jerks.

    reach (rows,): seconds over which a jerk at its limit changes the legs' velocities by what they are.
    """

    speed: Floats
    acceleration: Floats
    jerk: Floats
    reach: Floats

    @property
    def exceeds(self) -> bool:
        """Whether a share is above the goal."""
        return bool((self.slowing > 1.0).any())

    @cached_property
    def slowing(self) -> Floats:
        """Factor (rows,) by which the motion must be slower at each row to keep the goal."""
        return np.maximum(np.maximum(self.speed / GOAL, np.sqrt(self.acceleration / GOAL)), np.cbrt(self.jerk / GOAL))

    def without_edges(self, start: int, end: int) -> LimitShares:
        """Return the shares, zero in so many rows at the start and at the end."""
        rows = np.arange(len(self.speed))
        inside = (rows >= start) & (rows < len(rows) - end)
        speed, acceleration, jerk = (np.where(inside, y, 0.0) for y in (self.speed, self.acceleration, self.jerk))
        return LimitShares(speed, acceleration, jerk, self.reach)

    def at(self, rows: Ints) -> LimitShares:
        """Return the shares of some of the rows (n,)."""
        return LimitShares(*(getattr(self, name)[rows] for name in _COLUMNS))

    @classmethod
    def joined(cls, shares: Sequence[LimitShares]) -> LimitShares:
        """Return the shares of one after the other."""
        return cls(*(np.concatenate([getattr(one, name) for one in shares]) for name in _COLUMNS))


_COLUMNS = tuple(field.name for field in fields(LimitShares))


@dataclass(frozen=True, eq=False)
class Setpoints:
    """A piece with its law, which lasts whole periods.

    before, after: periods for which the machine stands at its ends; between two pieces they count with the first.
    jerk_limited: whether limits of jerk count.
    """

    profile: PieceProfile
    law: MotionLaw
    jerk_limited: bool
    period: float
    before: int
    after: int

    @property
    def count(self) -> int:
        """Number of intervals between rows."""
        return self.before + round(self.law.duration / self.period) + self.after

    def rows(self, low: int, high: int, phase: float = 0.0) -> SetpointRows:
        """Return the rows from `low` to `high`, both included, as if they came `phase` periods later."""
        s = self.law((np.arange(low, high + 1) - self.before + phase) * self.period)
        if high == self.count and phase == 0.0:
            s[-1] = self.law.length
        return SetpointRows.at(self.profile.piece, s, tool=self.profile.limits.of_tool)

    def spline_padding(self, *, start: bool) -> SetpointRows:
        """Return rows that come to the start, or leave the end, at the speed that is given there."""
        profile = self.profile
        speed = (profile.x_start if start else profile.x_end) ** 0.5
        return spline_padding(profile.piece, speed, self.period, start=start, tool=profile.limits.of_tool)

    def shares(self, rows: SetpointRows, machine: Machine, first: int, count: int) -> LimitShares:
        """Return the shares of the limits in `count` intervals of rows, from interval `first` on."""
        controller = machine.controller
        joined = InterpolatedSetpoints(
            rows, self.profile.piece, controller.period, controller.interpolation, first, count
        )
        at_rows: dict[Group, Floats] = {group: np.zeros(count + 1) for group in ("speed", "acceleration", "jerk")}
        between: dict[Group, Floats] = {group: np.zeros(count) for group in at_rows}
        for limit in self.profile.limits.all:
            if limit.group != "jerk" or self.jerk_limited:
                used = limit.used(joined)
                kept = at_rows if len(used) > count else between
                kept[limit.group] = np.maximum(kept[limit.group], used)
        speed, acceleration, jerk = (np.maximum(at_rows[group], _at_rows(between[group])) for group in at_rows)
        reach = np.sqrt(row_maxima(joined.legs.rates[joined.own_intervals] / machine.legs.max_jerk))
        return LimitShares(speed, acceleration, jerk, _at_rows(reach))


def _at_rows(shares: Floats) -> Floats:
    """Return for each row the larger share of the intervals that it ends."""
    return np.maximum(np.append(shares, 0.0), np.append(0.0, shares))


def measured(pieces: Sequence[Setpoints], machine: Machine, known: Sequence[LimitShares | None]) -> list[LimitShares]:
    """Return the shares of each piece; those that are known are not measured again."""
    begins = np.concatenate([[0], np.cumsum([piece.count for piece in pieces])]).tolist()
    lengths = np.concatenate([[0.0], np.cumsum([piece.law.length for piece in pieces])])
    asked = [k for k, same in enumerate(known) if same is None]
    found = in_threads(lambda k: _measured(pieces, begins, lengths, k, machine), asked)
    return [next(found) if same is None else same for same in known]


def unaffected(pieces: Sequence[Setpoints], shares: list[LimitShares], changed: list[int]) -> list[LimitShares | None]:
    """Return the shares of the pieces from which no changed one is within EDGE rows; None for the others."""
    ends = np.cumsum([piece.count for piece in pieces])
    begins = np.concatenate([[0], ends[:-1]])
    near = np.zeros(len(pieces), dtype=bool)
    for k in changed:
        near |= (begins <= ends[k] + EDGE) & (ends >= begins[k] - EDGE)
    return [None if touched else one for touched, one in zip(near.tolist(), shares, strict=True)]


def _measured(pieces: Sequence[Setpoints], begins: list[int], lengths: Floats, k: int, machine: Machine) -> LimitShares:
    """Return the shares of piece k; the pieces begin at rows `begins` and at stations `lengths`."""

    def shares_of(block: slice) -> LimitShares:
        low, high = begins[k] + block.start, begins[k] + block.stop
        first, last = max(low - EDGE, 0), min(high + EDGE, begins[-1])
        rows = _rows(pieces, begins, lengths, first, last)
        first_row = low - first
        if first == 0 and pieces[0].profile.x_start > 0.0:
            ahead = pieces[0].spline_padding(start=True)[:-1]
            rows, first_row = SetpointRows.concatenated([ahead, rows]), first_row + len(ahead)
        if last == begins[-1] and pieces[-1].profile.x_end > 0.0:
            behind = pieces[-1].spline_padding(start=False)[1:]
            rows = SetpointRows.concatenated([rows, behind.shifted(lengths[-2])])
        shares = pieces[k].shares(rows.shifted(-lengths[k]), machine, first_row, high - low)
        return shares if high == begins[k + 1] else shares.at(np.arange(high - low))

    return LimitShares.joined(on_all_cores(shares_of, list(blocks(begins[k + 1] - begins[k], ROWS_AT_ONCE))))


def _rows(pieces: Sequence[Setpoints], begins: list[int], lengths: Floats, first: int, last: int) -> SetpointRows:
    """Return the rows from `first` to `last`, both included, of all pieces one after the other."""
    parts: list[SetpointRows] = []
    begin = max(int(np.searchsorted(begins, first, "right")) - 1, 0)
    for k in range(min(begin, len(pieces) - 1), len(pieces)):
        low, high = max(first - begins[k], 0), min(last, begins[k + 1]) - begins[k]
        if low > high:
            break
        rows = pieces[k].rows(low, high).shifted(lengths[k])
        # The last row of a piece is the first row of the next one.
        parts.append(rows[:-1] if last > begins[k + 1] else rows)
    return SetpointRows.concatenated(parts)
