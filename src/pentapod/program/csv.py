"""Program files: a header, then `time_s,leg1_mm,leg2_mm,…`, one row each period. Writer and reader."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from io import BufferedReader
from pathlib import Path

import numpy as np

from pentapod.base.errors import ProgramError
from pentapod.base.files import atomic_write
from pentapod.base.refusal import stage
from pentapod.program.csv_rows import POWER_DECIMALS, TimeCheck, columns_of, read_rows, rows_text
from pentapod.program.header import MAGIC, Header, header_text
from pentapod.program.header_reader import parse_header
from pentapod.program.program import FORMAT_VERSION, Program
from pentapod.program.resolution import MM_DECIMALS, to_millimetres

ROWS_AT_ONCE = 20_000
LONGEST_LINE, MOST_LINES = 1 << 22, 1_000  # of the header: bytes in all, and lines


@stage
def write_csv(program: Program, path: str | Path) -> Path:
    """Write a program atomically and return its path. Same program, same bytes.

    Lengths are rounded to the resolution of the file, 1e-8 mm; those of `sample` have it already. Raises InputError
    where the file cannot be written.

    >>> write_csv(program, "program.csv").name
    'program.csv'
    """
    with atomic_write(path) as temporary, temporary.open("wb") as out:
        out.writelines(_pieces(program))
    return Path(path)


def csv_bytes(program: Program) -> bytes:
    """Return what `write_csv` writes."""
    return b"".join(_pieces(program))


def read_csv(path: str | Path) -> Program:
    """Return the program in a file, exactly as it was sampled. Raises ProgramError with file and line.

    Read in blocks, so that a long program is never in memory as text. Errors are: not a program, an unknown format
    version, a header with a missing or wrong key, a truncated file, a wrong number of columns or rows, NaN, and rows
    whose time is not k · period.

    >>> read_csv(write_csv(program, "program.csv")) == program
    True
    """
    file = Path(path)
    with _opened(file) as source:
        header, first_line = _header(source, file)
        times = TimeCheck(header.period, _time_decimals(header.period))
        names = columns_of(header.legs, powered=header.powered).split(",")
        rows = read_rows(source, header.rows, names, times, first_line, file)
    if header.powered:
        return header.program(rows[:, :-1], rows[:, -1])
    return header.program(rows)


def read_header(path: str | Path) -> Header:
    """Return the header of a program file. Raises ProgramError with file and line."""
    file = Path(path)
    with _opened(file) as source:
        return _header(source, file)[0]


def _pieces(program: Program) -> Iterator[bytes]:
    """Yield the file in pieces, so that a long program is never in memory as text as a whole."""
    power, legs = program.laser_power, program.legs.shape[1]
    yield (header_text(program) + columns_of(legs, powered=power is not None) + "\n").encode()
    decimals = [_time_decimals(program.period), *[MM_DECIMALS] * legs, *([] if power is None else [POWER_DECIMALS])]
    for start in range(0, len(program.legs), ROWS_AT_ONCE):
        rows = slice(start, start + ROWS_AT_ONCE)
        columns = [to_millimetres(program.legs[rows]), *([] if power is None else [power[rows, None]])]
        times = np.arange(start, start + len(columns[0])) * program.period
        yield rows_text(np.concatenate([times[:, None], *columns], axis=1, dtype=np.float64), np.array(decimals))


def _time_decimals(period: float) -> int:
    """Return 6 decimals for a period of whole microseconds, else 9: enough to number the rows."""
    return 6 if abs(period * 1e6 - round(period * 1e6)) < 1e-9 else 9


@contextmanager
def _opened(file: Path) -> Generator[BufferedReader]:
    try:
        with file.open("rb") as source:
            yield source
    except FileNotFoundError as error:
        raise ProgramError("no such file", file=file, expected="a program file") from error
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise ProgramError(f"cannot be read: {reason}", file=file, expected="a program file") from error


def _header(source: BufferedReader, file: Path) -> tuple[Header, int]:
    """Return the header and the line number of the first row, which is read next."""
    lines, total = list[str](), 0
    line = source.readline(LONGEST_LINE)
    if not line.startswith(b"#"):
        if not line.strip() and not source.read(LONGEST_LINE).strip():
            raise ProgramError("the file is empty", file=file, expected="a pentapod program")
        raise ProgramError("not a pentapod program", file=file, line=1, expected=f"# {MAGIC} = {FORMAT_VERSION}")
    while line.startswith(b"#"):
        total += len(line)
        if total >= LONGEST_LINE or len(lines) >= MOST_LINES:
            what = "the header is longer than any"
            raise ProgramError(what, file=file, line=len(lines) + 1, expected=f"at most {MOST_LINES} lines")
        if not line.endswith(b"\n"):
            raise ProgramError("the file ends within the header", file=file, line=len(lines) + 1)
        try:
            lines.append(line[:-1].decode())
        except UnicodeDecodeError as error:
            raise ProgramError("not a pentapod program: not UTF-8 text", file=file, line=len(lines) + 1) from error
        line = source.readline(LONGEST_LINE)
    header = parse_header(lines, file)
    names = line.decode(errors="replace").rstrip("\r\n")
    if names != (expected := columns_of(header.legs, powered=header.powered)):
        raise ProgramError("wrong column names", file=file, line=len(lines) + 1, value=names[:80], expected=expected)
    return header, len(lines) + 2
