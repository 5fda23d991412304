"""Posts described as tables: one row for each setpoint, with given columns, units and number format.

The table of another controller takes a few lines in a package of one's own, named by an entry point of the group
"pentapod.posts":

    POST = table_post("mine", "the drives of my machine", Table({
        "legs.txt": (Column("t", "time", "ms", 3), *leg_columns("L{leg}", "length", "um", 5)),
    }, separator=";"))
"""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import takewhile
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError, ProgramError
from pentapod.base.values import Value
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.program.csv_rows import POWER, POWER_DECIMALS, numbers_in
from pentapod.program.header import Header, header_text
from pentapod.program.posts.motion import velocities
from pentapod.program.posts.registry import Post, PostInput
from pentapod.program.posts.rows import check_legs, check_power, check_rows, header_of, read_file
from pentapod.program.program import Program
from pentapod.program.resolution import QUANTA_PER_M

Kind = Literal["time", "length", "velocity", "power"]

UNITS: dict[Kind, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e3, "us": 1e6},
    "length": {"m": 1.0, "mm": 1e3, "um": 1e6, "inch": 1.0 / 0.0254},
    "velocity": {"m/s": 1.0, "mm/s": 1e3, "mm/min": 6e4, "um/s": 1e6},
    "power": {"": 1.0},
}
"""Units by kind, and how many make one SI unit."""

LEGS = FiveLegs.n_legs
"""Legs of the tables that are not told how many there are."""

SIDECAR = "program.header"
"""File with the header where a table has no comments."""


@dataclass(frozen=True)
class Column(Value):
    """A column: title, kind, unit, decimals; leg, from 1 on, for lengths and velocities.

    A power is the laser's share of full power; its unit is "". Raises InputError for an unknown kind or unit, and where
    the leg is missing, or given for a time or a power.
    """

    title: str
    kind: Kind
    unit: str
    decimals: int
    leg: int | None = None

    def __post_init__(self) -> None:
        if self.kind not in UNITS:
            raise InputError("unknown kind", key=self.title, value=self.kind, expected=", ".join(UNITS))
        if self.unit not in UNITS[self.kind]:
            raise InputError("unknown unit", key=self.title, value=self.unit, expected=", ".join(UNITS[self.kind]))
        if (self.leg is None) != (self.kind in ("time", "power")) or (self.leg is not None and self.leg < 1):
            raise InputError(
                "wrong leg", key=self.title, value=self.leg, expected="1, 2, ...; none for a time or a power"
            )

    @property
    def factor(self) -> float:
        """How many of the unit make one SI unit."""
        return UNITS[self.kind][self.unit]

    @property
    def exact(self) -> bool:
        """Whether leg lengths at the resolution of programs are written without rounding."""
        quantum = self.factor / QUANTA_PER_M
        return quantum >= 0.999 * 10.0**-self.decimals and self.unit != "inch"

    def values(self, program: Program) -> Floats:
        """Return the column (N,), in its unit."""
        if self.kind == "power":
            return np.zeros(len(program.legs)) if program.laser_power is None else program.laser_power
        if self.leg is None:
            return program.times * self.factor
        if self.kind == "velocity":
            return velocities(program)[:, self.leg - 1] * self.factor
        # From counts of the resolution, so that the digits are those of the program.
        return np.rint(program.legs[:, self.leg - 1] * QUANTA_PER_M) / (QUANTA_PER_M / self.factor)


POWER_COLUMN = Column(POWER, "power", "", POWER_DECIMALS)
POWER_FILE = "laser_power.txt"
"""The column of the laser's power, and its file where each leg has one."""

Files: TypeAlias = Mapping[str, tuple[Column, ...]]
"""Columns by file name."""


@dataclass(frozen=True)
class Table(Value):
    """The files of a post: columns by file name, and how rows are written.

    files: or a function that returns them for a number of legs. comment: mark of lines that the controller skips, for
    the header; None: the header is a file of its own. titles: whether a row of titles precedes the numbers. Raises
    InputError unless every leg's length is in one of the files.
    """

    files: Files | Callable[[int], Files]
    separator: str = ","
    comment: str | None = "#"
    titles: bool = True

    def __post_init__(self) -> None:
        self.files_for(LEGS)

    def all_files(self, legs: int, *, powered: bool) -> Files:
        """Return `files_for`, with the laser's power as the last column of the first file, where there is a power.

        Files with one leg each have it in a file of its own.
        """
        files = self.files_for(legs)
        first = next(iter(files.values()))
        if not powered:
            return files
        if len(files) == 1:
            return {name: (*columns, POWER_COLUMN) for name, columns in files.items()}
        return {**files, POWER_FILE: (*(c for c in first if c.kind == "time"), POWER_COLUMN)}

    def files_for(self, legs: int) -> Files:
        """Return the columns by file name for so many legs. Raises InputError where they are of others."""
        files = self.files(legs) if callable(self.files) else self.files
        found = {c.leg for columns in files.values() for c in columns if c.kind == "length"}
        if found != set(range(1, legs + 1)):
            raise InputError(
                "the length of a leg is missing", key="files", value=sorted(x for x in found if x),
                expected=f"a length column for each of the legs 1 to {legs}",
                remedy="files can be a function of the number of legs",
            )  # fmt: skip
        return files


def leg_columns(title: str, kind: Kind, unit: str, decimals: int, legs: int = LEGS) -> tuple[Column, ...]:
    """Return a column for each leg; "{leg}" in the title becomes the leg's number."""
    return tuple(Column(title.format(leg=leg), kind, unit, decimals, leg) for leg in range(1, legs + 1))


def table_post(name: str, about: str, table: Table) -> Post:
    """Return the post that a table describes."""
    every = table.files_for(LEGS).values()
    rounded = any(c.kind == "length" and not c.exact for columns in every for c in columns)
    loses = frozenset({"digits"} if rounded else ())
    return Post(name, about, partial(_write, table=table), partial(_read, table=table), loses)


def _write(given: PostInput, table: Table) -> dict[str, bytes]:
    header, mark, power = header_text(given.program), table.comment, given.program.laser_power
    files = {SIDECAR: header.encode()} if mark is None else {}
    for name, columns in table.all_files(given.program.legs.shape[1], powered=power is not None).items():
        text = "" if mark is None else "".join(f"{mark}{line.removeprefix('#')}\n" for line in header.splitlines())
        if table.titles:
            text += table.separator.join(column.title for column in columns) + "\n"
        row = table.separator.join(f"%.{column.decimals}f" for column in columns) + "\n"
        # Rounded first, so that there is no "-0.000".
        numbers = np.column_stack([np.round(c.values(given.program), c.decimals) + 0.0 for c in columns])
        files[name] = (text + (row * len(numbers)) % tuple(numbers.ravel().tolist())).encode()
    return files


def _read(folder: Path, table: Table) -> Program:
    first = folder / next(iter(table.files_for(LEGS)))
    header, above = _header(folder, {first: _lines(first)}, table)
    files = table.all_files(header.legs, powered=header.powered)
    texts = {folder / name: _lines(folder / name) for name in files}
    if len(texts) > 1:
        _header(folder, texts, table)
    legs: dict[int, Floats] = {}
    rates, power = list[tuple[Path, Column, Floats]](), None
    for (file, lines), columns in zip(texts.items(), files.values(), strict=True):
        numbers = _numbers(lines[above:], columns, table, file, above + 1)
        check_rows(len(numbers), header, file)
        for column, values in zip(columns, numbers.T, strict=True):
            if column.kind == "power":
                power = values
            elif column.leg is None:
                expected = header.period * column.factor * np.arange(len(values), dtype=np.float64)
                _check_close(values, expected, column, file, "the time is not a multiple of the period")
            elif column.kind == "length":
                legs[column.leg] = values / column.factor
            else:
                rates.append((file, column, values))
    rows = check_legs(np.column_stack([legs[leg + 1] for leg in range(header.legs)]), folder)
    program = header.program(rows, check_power(power, header, folder))
    for file, column, values in rates:
        _check_close(values, column.values(program), column, file, "not the velocity of the spline through the rows")
    return program


def _lines(file: Path) -> list[str]:
    return read_file(file).decode(errors="replace").splitlines()


def _header(folder: Path, texts: Mapping[Path, list[str]], table: Table) -> tuple[Header, int]:
    """Return the header, and the number of comment lines above the rows of each file.

    Raises ProgramError where the files are not of one program.
    """
    if table.comment is None:
        sidecar = folder / SIDECAR
        return header_of(read_file(sidecar).decode(errors="replace").splitlines(), sidecar), 0
    mark = table.comment
    headers = {file: list(takewhile(lambda text: text.startswith(mark), lines)) for file, lines in texts.items()}
    first, above = next(iter(headers.items()))
    for file, lines in headers.items():
        if lines != above:
            raise ProgramError(f"the header is not that of {first.name}", file=file, remedy="write the post again")
    return header_of(["#" + line.removeprefix(mark) for line in above], first), len(above)


def _numbers(lines: list[str], columns: tuple[Column, ...], table: Table, file: Path, first: int) -> Floats:
    """Return the numbers (N, columns) below the header; first: number of their first line."""
    if table.titles:
        titles = table.separator.join(column.title for column in columns)
        if not lines or lines[0] != titles:
            raise ProgramError("wrong titles", file=file, line=first, value="".join(lines[:1])[:80], expected=titles)
        lines, first = lines[1:], first + 1
    text = "\n".join(lines)
    try:
        numbers = np.loadtxt(io.StringIO(text), delimiter=table.separator, comments=None, ndmin=2)
    except ValueError:
        numbers = np.empty((0, 0))
    if numbers.size and numbers.shape == (len(lines), len(columns)) and np.isfinite(numbers).all():
        return numbers
    if not lines:
        raise ProgramError("there are no rows", file=file, line=first)
    return numbers_in(lines, [column.title for column in columns], table.separator, first, file)


def _check_close(values: Floats, expected: Floats, column: Column, file: Path, what: str) -> None:
    """Raise ProgramError at the first value that is wrong by more than half a unit of the last digit."""
    wrong = np.abs(values - expected) > 0.51 * 10.0**-column.decimals + 1e-9 * np.abs(expected)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise ProgramError(
            f"{what} (row {row + 1})", file=file, key=column.title, value=float(values[row]),
            expected=f"{expected[row]:.9g} {column.unit}",
        )  # fmt: skip
