"""Reader of the rows of a program file, by blocks: a kernel, or NumPy's text parser; errors name the first bad row."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import ProgramError
from pentapod.base.files import number_in
from pentapod.numerics.kernels import kernels_pay
from pentapod.program.resolution import LARGEST_M, from_millimetres

BLOCK_BYTES = 1 << 22
SAVED_BY_KERNELS = 1.5e-8
"""Seconds for each byte; see `numerics.kernels`."""
SAVED_BY_WRITING = 1.7e-7
"""Seconds for each number, likewise."""
POWER, POWER_DECIMALS = "laser_power", 6
"""Name of the column with the laser's power, and its decimals."""
_PLAIN = b"0123456789+-.eE,\n\r"
_TO_COMMAS = bytes.maketrans(b"\n", b",")


def columns_of(legs: int, *, powered: bool = False) -> str:
    """Return the line that names the columns of a program for so many legs; powered: with the laser's power."""
    return ",".join(["time_s", *(f"leg{leg + 1}_mm" for leg in range(legs)), *((POWER,) if powered else ())])


def rows_text(table: Floats, decimals: Ints) -> bytes:
    """Return rows of numbers (n, k) as text, each column with so many decimals (k,)."""
    if kernels_pay(SAVED_BY_WRITING * table.size):
        from pentapod.program.csv_rows_kernels import fill_rows  # noqa: PLC0415

        units = table * 10.0**decimals
        counts = np.rint(units)
        # A number halfway between two decimals is left to exact arithmetic.
        if counts.min() >= 0.0 and counts.max() < 2.0**53 and (np.abs(units - counts) < 0.5 - 1e-3).all():
            text = np.empty(21 * table.size, dtype=np.uint8)
            return text[: fill_rows(counts.astype(np.int64), decimals, text)].tobytes()
    row = ",".join(f"%.{places}f" for places in decimals.tolist()) + "\n"
    return ((row * len(table)) % tuple(table.ravel().tolist())).encode()


@dataclass(frozen=True)
class TimeCheck:
    """Row k has the time k · period seconds, written with so many decimals and no more."""

    period: float
    decimals: int

    def check(self, times: Floats, row: int, first_line: int, file: Path) -> None:
        """Raise ProgramError at the first row whose time is wrong by more than half a unit of the last digit.

        times (n,): of the rows from `row` on; first_line: line number of the first row of the file.
        """
        expected = np.arange(row, row + len(times)) * self.period
        tolerance = 0.51 * 10.0**-self.decimals + 1e-12 * expected
        # More digits than are written could hide another period within the rounding.
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
        line, value = first_line + row + k, float(times[k])
        raise ProgramError(what, file=file, line=line, value=value, expected=f"{expected[k]:.9g} s")


def read_rows(
    source: BufferedReader, rows: int, names: Sequence[str], times: TimeCheck, first_line: int, file: Path
) -> Floats:
    """Return the rows from the source's position to its end, without their times. Raises ProgramError.

    names: of the columns. Leg lengths are in metres; the laser's power, if there is any, is the last column.
    """
    width, legs_of_row = len(names) - 1, len(names) - 1 - (names[-1] == POWER)
    shortest = 2 * len(names)  # bytes of a row
    size = os.fstat(source.fileno()).st_size - source.tell()
    legs = np.empty((0, width))
    count, rest = 0, b""
    while block := source.read(BLOCK_BYTES):
        end = block.rfind(b"\n") + 1
        if not end:
            what = (
                f"a row of more than {len(block):,} bytes"
                if len(block) == BLOCK_BYTES
                else "the file ends within a row"
            )
            remedy = "it was truncated, or is no program"
            raise ProgramError(what, file=file, line=first_line + count, remedy=remedy)
        data, rest = rest + block[:end], block[end:]
        table = _table(data, names, first_line + count, file)
        times.check(table[:, 0], count, first_line, file)
        _check_lengths(table[:, : legs_of_row + 1], names, first_line + count, file)
        _check_powers(table[:, legs_of_row + 1 :], first_line + count, file)
        if not count:
            # The header may give more rows than the file can hold: no memory for those.
            legs = np.empty((min(rows, size // shortest + 1), width))
        kept = max(0, min(len(table), len(legs) - count))
        legs[count : count + kept, :legs_of_row] = from_millimetres(table[:kept, 1 : legs_of_row + 1])
        legs[count : count + kept, legs_of_row:] = table[:kept, legs_of_row + 1 :]
        count += len(table)
    if rest:
        raise ProgramError("the file ends within a row", file=file, line=first_line + count, remedy="it was truncated")
    if count == 0:
        raise ProgramError("there are no rows", file=file, line=first_line, expected=f"{rows} rows")
    if count != rows:
        what, line = (
            "the number of rows is not that of the header: the file was truncated or rows were added",
            count - 1,
        )
        raise ProgramError(what, file=file, line=first_line + line, key="rows", value=count, expected=str(rows))
    return legs


def _table(data: bytes, names: Sequence[str], first_line: int, file: Path) -> Floats:
    """Return the numbers (n, 1 + n_legs) of whole lines: fast where they are plain, else row by row."""
    if kernels_pay(SAVED_BY_KERNELS * len(data)):
        from pentapod.program.csv_rows_kernels import plain_rows  # noqa: PLC0415

        table = np.empty((data.count(b"\n"), len(names)))
        if plain_rows(np.frombuffer(data, np.uint8), table) == len(table):
            return table
    letters = np.frombuffer(data, np.uint8)
    ends = letters[np.flatnonzero((letters == ord(",")) | (letters == ord("\n")))]
    plain = not data.translate(None, _PLAIN) and data.count(b"\r") == data.count(b"\r\n")
    if plain and len(ends) % len(names) == 0:
        columns = ends.reshape(-1, len(names))
        if (columns[:, -1] == ord("\n")).all() and (columns[:, :-1] == ord(",")).all():
            with warnings.catch_warnings():
                warnings.simplefilter("error", DeprecationWarning)  # raised for text that is not a number
                try:
                    numbers = np.fromstring(data.translate(_TO_COMMAS, b"\r"), sep=",")
                except (DeprecationWarning, ValueError):
                    numbers = np.empty(0)
            if numbers.size == columns.size and np.isfinite(numbers).all():
                return numbers.reshape(-1, len(names))
    lines = [line.decode(errors="replace") for line in data.split(b"\n")[:-1]]
    return numbers_in(lines, names, ",", first_line, file)


def numbers_in(lines: list[str], names: Sequence[str], separator: str, first_line: int, file: Path) -> Floats:
    """Return the numbers (n, k) of a table's lines, row by row. Raises ProgramError at the first bad row."""
    table: list[list[float]] = []
    for line, text in enumerate(lines, start=first_line):
        cells = text.split(separator)
        if len(cells) != len(names):
            what, expected = "wrong number of columns", str(len(names))
            raise ProgramError(what, file=file, line=line, value=len(cells), expected=expected)
        row: list[float] = []
        for name, cell in zip(names, cells, strict=True):
            value = number_in(cell.strip())
            if value is None:
                raise ProgramError("not a finite number", file=file, line=line, key=name, value=cell.strip()[:40])
            row.append(value)
        table.append(row)
    return np.array(table)


def _check_lengths(table: Floats, names: Sequence[str], first_line: int, file: Path) -> None:
    wrong = (table[:, 1:] <= 0.0) | (table[:, 1:] > 1e3 * LARGEST_M)
    if wrong.any():
        row, leg = np.argwhere(wrong)[0]
        what, line, value = "a leg length that no machine has", first_line + int(row), float(table[row, leg + 1])
        raise ProgramError(
            what, file=file, line=line, key=names[int(leg) + 1], value=value, expected="between 0 and 10 km"
        )


def _check_powers(table: Floats, first_line: int, file: Path) -> None:
    wrong = (table < 0.0) | (table > 1.0)
    if wrong.any():
        row = int(np.argmax(wrong))
        what, value, expected = "not a share of the laser's full power", float(table[row, 0]), "0 to 1"
        raise ProgramError(what, file=file, line=first_line + row, key=POWER, value=value, expected=expected)
