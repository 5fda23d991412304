"""RunLog: legs as a machine recorded them during a run, read from LinuxCNC's halsampler or from CSV."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import InputError, nearest
from pentapod.base.files import number_in, read_bytes
from pentapod.base.values import Value
from pentapod.program.posts.tables import UNITS

LEAST_ROWS = 50
"""Rows below which a log is no run."""

NUMBER, SKIPPED, OVERRUN = "number", "-", "overrun"
"""Column of halsampler -t, column that is not read, and halsampler's line where samples were lost."""

EXAMPLE = "number,legs_mm"
_OF_LEG = re.compile(r"(leg|command|force)([1-9][0-9]?)_([a-z_]+)")
_OF_ALL = re.compile(r"(leg|command|force)s_([a-z_]+)")
_TIME = re.compile(r"time_([a-z]+)")
_MARKS = str.maketrans(",;\t", "   ")


@dataclass(frozen=True, eq=False)
class RunLog(Value):
    """What was recorded at times (n,), seconds, ascending; gaps are allowed.

    legs (n, n_legs): measured lengths, metres. commands: what the drives were told, metres; forces: newtons, a push is
    positive; None where the log has no such columns. lines (n,): of the file, for messages.
    """

    file: Path
    times: Floats
    legs: Floats
    commands: Floats | None
    forces: Floats | None
    lines: range | Sequence[int]

    def __post_init__(self) -> None:
        for name in ("times", "legs", "commands", "forces"):
            if (values := getattr(self, name)) is not None:
                set_frozen(self, **{name: frozen(values, name, (None,) if name == "times" else (None, None))})

    @property
    def period(self) -> float:
        """The usual time from one row to the next, seconds."""
        return float(np.median(np.diff(self.times)))

    @property
    def lost(self) -> int:
        """Rows that are missing between others."""
        steps = np.diff(self.times) / self.period
        return int(np.rint(steps[steps > 1.5] - 1.0).sum())


def read_log(path: str | Path, n_legs: int, period: float, columns: str | None = None) -> RunLog:
    """Return the log in a file: one row a line, its numbers separated by commas, semicolons or spaces.

    columns: of a file without a line of titles, separated by commas: `legs_mm` or `leg1_mm`, …; `commands_mm` and
    `forces_n` likewise; `time_s`; `number`, of the sample; `-` for one that is not read. Lengths are in mm, m, um or
    inch. Without titles a file has the legs in mm, or the number and the legs. period: seconds between rows, where no
    column says it. Raises InputError with file and line: columns, units or numbers that are wrong, too few rows.

    >>> read_log("played.txt", 5, 1e-3, "number,commands_mm,legs_mm").legs.shape  # doctest: +SKIP
    (3200, 5)
    """
    file = Path(path)
    text = read_bytes(file, InputError, "a log: halsampler's output, or CSV").decode(errors="replace")
    kept, lines, lost = list[str](), list[int](), 0
    for number, line in enumerate(text.splitlines(), start=1):
        bare = line.translate(_MARKS).strip()
        if bare == OVERRUN:
            lost = lost or number
        elif bare and not bare.startswith("#"):
            kept.append(bare)
            lines.append(number)
    titles = columns.split(",") if columns is not None else _titles(kept, n_legs, file)
    if kept and number_in(kept[0].split()[0]) is None:
        kept, lines = kept[1:], lines[1:]
    names, factors = _columns(titles, n_legs, file, given=columns is not None)
    table = _numbers(kept, lines, titles, file)
    if len(table) < LEAST_ROWS:
        raise InputError("too few rows for a run", file=file, value=len(table), expected=f"at least {LEAST_ROWS}")
    times = _times(table, names, factors, period, file, lost)
    late = np.flatnonzero(np.diff(times) <= 0.0)
    if len(late):
        raise InputError(
            "the time does not grow from the row before", file=file, line=lines[late[0] + 1],
            remedy="one run in a file, in the order in which it was recorded",
        )  # fmt: skip
    found = {kind: _of_kind(table, names, factors, kind, n_legs) for kind in ("leg", "command", "force")}
    legs = found["leg"]
    if legs is None:
        raise InputError("no column has the measured legs", file=file, expected=EXAMPLE, remedy="name it by --columns")
    return RunLog(file, times, legs, found["command"], found["force"], lines)


def _titles(kept: list[str], n_legs: int, file: Path) -> list[str]:
    """Return the titles of the first line, or those of a file of numbers alone. Raises InputError."""
    first = kept[0].split() if kept else []
    if first and number_in(first[0]) is None:
        return first
    if len(first) == n_legs:
        return ["legs_mm"]
    if len(first) == n_legs + 1:
        return [NUMBER, "legs_mm"]
    raise InputError(
        "the columns have no titles, and their number does not tell what they are", file=file, value=len(first),
        expected=f"{n_legs} legs in mm, or the sample's number before them",
        remedy=f'say what they are with --columns, such as "{EXAMPLE},-"',
    )  # fmt: skip


def _columns(titles: Sequence[str], n_legs: int, file: Path, *, given: bool) -> tuple[list[str], list[float]]:
    """Return kind and leg ("leg 1") of each column, and how many of its unit make one of SI. Raises InputError."""
    names, factors = list[str](), list[float]()
    where = "--columns" if given else "titles"
    for title in (title.strip() for title in titles):
        of_leg, of_all, of_time = _OF_LEG.fullmatch(title), _OF_ALL.fullmatch(title), _TIME.fullmatch(title)
        if of_time or title == NUMBER:
            names.append("time" if of_time else NUMBER)
            factors.append(_factor(title, of_time[1], "time", file, where) if of_time else 1.0)
        elif of_leg or of_all:
            kind, unit = (of_leg[1], of_leg[3]) if of_leg else (of_all[1], of_all[2]) if of_all else ("", "")
            legs = [int(of_leg[2])] if of_leg else list(range(1, n_legs + 1))
            if legs[-1] > n_legs:
                expected = f"1 to {n_legs}"
                raise InputError("the machine has no such leg", file=file, key=where, value=title, expected=expected)
            names += [f"{kind} {leg}" for leg in legs]
            factors += [_factor(title, unit, "force" if kind == "force" else "length", file, where)] * len(legs)
        elif title == SKIPPED or not (given or re.match(r"(leg|command|force|time)", title)):
            names.append(SKIPPED)
            factors.append(1.0)
        else:
            one = (f"{kind}{leg}_mm" for kind in ("leg", "command") for leg in range(1, n_legs + 1))
            known = (*one, "legs_mm", "commands_mm", "forces_n", "force1_n", "time_s", NUMBER)
            raise InputError(
                "unknown column", file=file, key=where, value=title, expected="a name with its unit, or - to skip it",
                remedy=nearest(title, known),
            )  # fmt: skip
    twice = next((name for name in names if name != SKIPPED and names.count(name) > 1), None)
    if twice is not None:
        raise InputError("a column is named twice", file=file, key=where, value=twice)
    return names, factors


def _factor(title: str, unit: str, kind: str, file: Path, where: str) -> float:
    units = {"n": 1.0} if kind == "force" else UNITS["time" if kind == "time" else "length"]
    if unit not in units:
        expected = " or ".join(units)
        raise InputError(
            "unknown unit", file=file, key=where, value=title, expected=f"a name that ends with {expected}"
        )
    return units[unit]


def _numbers(kept: list[str], lines: Sequence[int], titles: Sequence[str], file: Path) -> Floats:
    """Return the numbers (n, columns) of the rows. Raises InputError at the first bad one."""
    width = len(kept[0].split()) if kept else 0
    try:
        table = np.loadtxt(io.StringIO("\n".join(kept)), comments=None, ndmin=2) if kept else np.empty((0, 0))
        if np.isfinite(table).all():
            return np.asarray(table, dtype=np.float64)
    except ValueError:
        pass
    for line, text in zip(lines, kept, strict=True):
        cells = text.split()
        bad = next((k for k, cell in enumerate(cells) if number_in(cell) is None), None)
        if len(cells) != width:
            raise InputError("wrong number of columns", file=file, line=line, value=len(cells), expected=f"{width}")
        if bad is not None:
            key = titles[bad] if len(titles) == width else f"column {bad + 1}"
            remedy = "cut the log before this row, or record again"
            raise InputError("not a finite number", file=file, line=line, key=key, value=cells[bad][:40], remedy=remedy)
    return np.array([[float(cell) for cell in text.split()] for text in kept])


def _times(
    table: Floats, names: Sequence[str], factors: Sequence[float], period: float, file: Path, lost: int
) -> Floats:
    """Return the time (n,) of each row, seconds. Raises InputError: columns without names, lost rows not numbered."""
    if table.shape[1] != len(names):
        raise InputError(
            "the rows have another number of columns than names are given", file=file, value=table.shape[1],
            expected=f"{len(names)}: {', '.join(names)}"[:160], remedy="name each by --columns, with - to skip one",
        )  # fmt: skip
    for name in ("time", NUMBER):
        if name in names:
            k = names.index(name)
            return np.asarray(table[:, k] * (1.0 / factors[k] if name == "time" else period), dtype=np.float64)
    if lost:
        remedy = "record with halsampler -t, which numbers the samples"
        raise InputError("samples were lost here, and nothing says how many", file=file, line=lost, remedy=remedy)
    return np.arange(len(table), dtype=np.float64) * period


def _of_kind(table: Floats, names: Sequence[str], factors: Sequence[float], kind: str, n_legs: int) -> Floats | None:
    """Return the columns (n, n_legs) of a kind in SI; None where one of them is missing."""
    wanted = [f"{kind} {leg}" for leg in range(1, n_legs + 1)]
    if any(name not in names for name in wanted):
        return None
    places = [names.index(name) for name in wanted]
    return table[:, places] / np.array([factors[k] for k in places])
