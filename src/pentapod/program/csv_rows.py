"""The rows of a program file, block by block: numbers by NumPy's text parser, and the first bad row by name."""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ProgramError
from pentapod.base.files import number_in
from pentapod.program.resolution import LARGEST_M, from_millimetres

COLUMNS = "time_s,leg1_mm,leg2_mm,leg3_mm,leg4_mm,leg5_mm"
_NAMES = COLUMNS.split(",")
_WIDTH = len(_NAMES)
_BLOCK = 1 << 22  # bytes
_SHORTEST = len("0,1,1,1,1,1\n")
_PLAIN = b"0123456789+-.eE,\n\r"
_TO_COMMAS = bytes.maketrans(b"\n", b",")


@dataclass(frozen=True)
class TimeCheck:
    """Row k is due at k · period seconds, written with so many decimals and no more."""

    period: float
    decimals: int

    def check(self, times: Floats, row: int, first_line: int, file: Path) -> None:
        """Raise ProgramError at the first row whose time is not its own, to half a unit of the last digit.

        times (n,): of the rows from `row` on; first_line: of the first row of all.
        """
        expected = np.arange(row, row + len(times)) * self.period
        tolerance = 0.51 * 10.0**-self.decimals + 1e-12 * expected
        # More digits than are written would hide another period behind the rounding.
        units = times * 10.0**self.decimals
        wrong = (np.abs(times - expected) > tolerance) | (np.abs(units - np.rint(units)) > 1e-6 + 1e-15 * np.abs(units))
        if not wrong.any():
            return
        k = int(np.argmax(wrong))
        before = float(times[k - 1] if k else expected[0] - self.period)
        steps = (float(times[k]) - before) / self.period if row + k else np.inf
        if abs(times[k] - expected[k]) <= tolerance[k]:
            what = f"the time is not a multiple of the period in {self.decimals} decimals"
        elif row + k and steps < 0.5:
            what = "the rows are out of order"
        elif row + k and steps < 1e9 and abs(steps - round(steps)) < 1e-3:
            what = f"{round(steps) - 1} rows are missing before this one"
        else:
            what = "the time is not a multiple of the period"
        raise ProgramError(
            what,
            file=file,
            line=first_line + row + k,
            value=float(times[k]),
            expected=f"{expected[k]:.9g} s",
        )


def read_rows(source: BufferedReader, rows: int, times: TimeCheck, first_line: int, file: Path) -> Floats:
    """Return leg lengths (rows, n_legs) in metres from where the source stands to its end. Raises ProgramError."""
    size = os.fstat(source.fileno()).st_size - source.tell()
    legs = np.empty((0, _WIDTH - 1))
    count, rest = 0, b""
    while block := source.read(_BLOCK):
        end = block.rfind(b"\n") + 1
        if not end:
            what = f"a row of more than {len(block):,} bytes" if len(block) == _BLOCK else "the file ends within a row"
            remedy = "it was truncated, or is no program"
            raise ProgramError(what, file=file, line=first_line + count, remedy=remedy)
        data, rest = rest + block[:end], block[end:]
        table = _table(data, first_line + count, file)
        times.check(table[:, 0], count, first_line, file)
        _check_lengths(table, first_line + count, file)
        if not count:
            # A header may promise more rows than there are; a file that holds no row at all costs nothing.
            legs = np.empty((min(rows, size // _SHORTEST + 1), _WIDTH - 1))
        kept = max(0, min(len(table), len(legs) - count))
        legs[count : count + kept] = from_millimetres(table[:kept, 1:])
        count += len(table)
    if rest:
        raise ProgramError("the file ends within a row", file=file, line=first_line + count, remedy="it was truncated")
    if count == 0:
        raise ProgramError("there are no rows", file=file, line=first_line, expected=f"{rows} rows")
    if count != rows:
        raise ProgramError(
            "the number of rows is not that of the header: the file was truncated or rows were added",
            file=file,
            line=first_line + count - 1,
            key="rows",
            value=count,
            expected=str(rows),
        )
    return legs


def _table(data: bytes, first_line: int, file: Path) -> Floats:
    """Return the numbers (n, 1 + n_legs) of whole lines; what is out of the ordinary is read, or named, row by row."""
    letters = np.frombuffer(data, np.uint8)
    ends = letters[np.flatnonzero((letters == ord(",")) | (letters == ord("\n")))]
    plain = not data.translate(None, _PLAIN) and data.count(b"\r") == data.count(b"\r\n")
    if plain and len(ends) % _WIDTH == 0:
        columns = ends.reshape(-1, _WIDTH)
        if (columns[:, -1] == ord("\n")).all() and (columns[:, :-1] == ord(",")).all():
            with warnings.catch_warnings():
                warnings.simplefilter("error", DeprecationWarning)  # what it says of text that is no number
                try:
                    numbers = np.fromstring(data.translate(_TO_COMMAS, b"\r"), sep=",")
                except (DeprecationWarning, ValueError):
                    numbers = np.empty(0)
            if numbers.size == columns.size and np.isfinite(numbers).all():
                return numbers.reshape(-1, _WIDTH)
    return _row_by_row(data, first_line, file)


def _row_by_row(data: bytes, first_line: int, file: Path) -> Floats:
    """Return the numbers (n, 1 + n_legs) of whole lines. Raises ProgramError at the first other row."""
    table: list[list[float]] = []
    for number, line in enumerate(data.split(b"\n")[:-1], start=first_line):
        fields = line.split(b",")
        if len(fields) != _WIDTH:
            raise ProgramError(
                "wrong number of columns", file=file, line=number, value=len(fields), expected=str(_WIDTH)
            )
        table.append([_number(field, name, number, file) for name, field in zip(_NAMES, fields, strict=True)])
    return np.array(table)


def _number(field: bytes, name: str, line: int, file: Path) -> float:
    text = field.decode(errors="replace").strip()
    value = number_in(text)
    if value is None:
        raise ProgramError("not a finite number", file=file, line=line, key=name, value=text[:40])
    return value


def _check_lengths(table: Floats, first_line: int, file: Path) -> None:
    wrong = (table[:, 1:] <= 0.0) | (table[:, 1:] > 1e3 * LARGEST_M)
    if wrong.any():
        row, leg = np.argwhere(wrong)[0]
        raise ProgramError(
            "a leg length that no machine has",
            file=file,
            line=first_line + int(row),
            key=_NAMES[leg + 1],
            value=float(table[row, leg + 1]),
            expected="between 0 and 10 km",
        )
