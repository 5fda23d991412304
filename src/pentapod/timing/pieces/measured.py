"""Use of the limits by the setpoints of all pieces in a row, as the controller interpolates across their borders."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.machine.machine import Machine
from pentapod.timing.path.joined import Rows
from pentapod.timing.pieces.setpoints import EDGE, Setpoints, Use

_AT_ONCE = 1 << 16
"""Rows measured at once: memory does not grow with the piece by more than four numbers a row."""


def measured(pieces: Sequence[Setpoints], machine: Machine, known: Sequence[Use | None]) -> list[Use]:
    """Return what each piece uses of the limits; what is known is not measured again."""
    begins = np.concatenate([[0], np.cumsum([piece.count for piece in pieces])]).tolist()
    lengths = np.concatenate([[0.0], np.cumsum([piece.law.length for piece in pieces])])
    return [_measured(pieces, begins, lengths, k, machine) if same is None else same for k, same in enumerate(known)]


def untouched(pieces: Sequence[Setpoints], uses: list[Use], changed: list[int]) -> list[Use | None]:
    """Return the uses of the pieces that are not changed and from which no changed one is within EDGE rows."""
    ends = np.cumsum([piece.count for piece in pieces])
    begins = np.concatenate([[0], ends[:-1]])
    near = np.zeros(len(pieces), dtype=bool)
    for k in changed:
        near |= (begins <= ends[k] + EDGE) & (ends >= begins[k] - EDGE)
    return [None if touched else use for touched, use in zip(near.tolist(), uses, strict=True)]


def _measured(pieces: Sequence[Setpoints], begins: list[int], lengths: Floats, k: int, machine: Machine) -> Use:
    parts: list[Use] = []
    for low in range(begins[k], begins[k + 1], _AT_ONCE):
        count = min(_AT_ONCE, begins[k + 1] - low)
        first, last = max(low - EDGE, 0), min(low + count + EDGE, begins[-1])
        rows = _rows(pieces, begins, lengths, first, last)
        first_row = low - first
        if first == 0 and pieces[0].profile.x_start > 0.0:
            ahead = pieces[0].spline_padding(start=True)[:-1]
            rows, first_row = Rows.concatenated([ahead, rows]), first_row + len(ahead)
        if last == begins[-1] and pieces[-1].profile.x_end > 0.0:
            behind = pieces[-1].spline_padding(start=False)[1:]
            rows = Rows.concatenated([rows, behind.shifted(lengths[-2])])
        use = pieces[k].use(rows.shifted(-lengths[k]), machine, first_row, count)
        parts.append(use if low + count == begins[k + 1] else use.at(np.arange(count)))
    return Use.joined(parts)


def _rows(pieces: Sequence[Setpoints], begins: list[int], lengths: Floats, first: int, last: int) -> Rows:
    """Return the rows from `first` to `last`, both included, of all pieces one after the other."""
    parts: list[Rows] = []
    begin = max(int(np.searchsorted(begins, first, "right")) - 1, 0)
    for k in range(min(begin, len(pieces) - 1), len(pieces)):
        low, high = max(first - begins[k], 0), min(last, begins[k + 1]) - begins[k]
        if low > high:
            break
        # Where a piece ends the next begins: that row is the next one's.
        goes_on = last > begins[k + 1]
        rows = pieces[k].rows(low, high).shifted(lengths[k])
        parts.append(rows[:-1] if goes_on else rows)
    return Rows.concatenated(parts)
