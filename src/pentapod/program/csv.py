"""Program files: a header, then `time_s,leg1_mm,…,leg5_mm`, one row each period. Writer and reader."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from io import BufferedReader
from pathlib import Path

import numpy as np

from pentapod.base.errors import ProgramError
from pentapod.base.files import atomic_write
from pentapod.base.refusal import stage
from pentapod.program.csv_rows import COLUMNS, TimeCheck, read_rows
from pentapod.program.header import MAGIC, Header, header_text, parse_header
from pentapod.program.program import FORMAT_VERSION, Program
from pentapod.program.resolution import MM_DECIMALS, to_millimetres

_CHUNK = 20_000
_LONGEST, _MOST_LINES = 65_536, 1_000  # bytes of a line of the header, and its lines


@stage
def write_csv(program: Program, path: str | Path) -> Path:
    """Write a program and return its path. Same program, same bytes; an interruption leaves no half file.

    Lengths that are not at the file's resolution (1e-8 mm; `sample` makes only such) are rounded to it.
    Raises InputError where the file cannot be written.
    """
    with atomic_write(path) as temporary, temporary.open("wb") as out:
        out.writelines(_pieces(program))
    return Path(path)


def csv_bytes(program: Program) -> bytes:
    """Return what `write_csv` writes."""
    return b"".join(_pieces(program))


def read_csv(path: str | Path) -> Program:
    """Return the program in a file, exactly as it was sampled. Raises ProgramError with file and line.

    Read in blocks, so that a long program is never in memory as text. Refused are: what is no program, an unknown
    format version, a header with a key missing or wrong, a truncated file, a wrong number of columns or rows, NaN, and
    rows whose time is not k · period.
    """
    file = Path(path)
    with _opened(file) as source:
        header, first_line = _header(source, file)
        legs = read_rows(source, header.rows, times_of(header.period), first_line, file)
    return header.program(legs)


def read_header(path: str | Path) -> Header:
    """Return what stands before the rows of a program file. Raises ProgramError with file and line."""
    file = Path(path)
    with _opened(file) as source:
        return _header(source, file)[0]


def _pieces(program: Program) -> Iterator[bytes]:
    """Yield the file in pieces, so that a long program is never in memory as text as a whole."""
    decimals = _time_decimals(program.period)
    row = f"%.{decimals}f" + f",%.{MM_DECIMALS}f" * program.legs.shape[1] + "\n"
    yield (header_text(program) + COLUMNS + "\n").encode()
    for start in range(0, len(program.legs), _CHUNK):
        legs = to_millimetres(program.legs[start : start + _CHUNK])
        times = np.arange(start, start + len(legs)) * program.period
        table = np.column_stack([times, legs])
        yield ((row * len(table)) % tuple(table.ravel().tolist())).encode()


def _time_decimals(period: float) -> int:
    """Return 6 where the period is a whole number of microseconds, else 9: enough to number the rows."""
    return 6 if abs(period * 1e6 - round(period * 1e6)) < 1e-9 else 9


def times_of(period: float) -> TimeCheck:
    """Return how the times of a program with this period are written."""
    return TimeCheck(period, _time_decimals(period))


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
    """Return the header and the line number of the first row, where the source then stands."""
    lines: list[str] = []
    line = source.readline(_LONGEST)
    if not line.startswith(b"#"):
        if not line.strip() and not source.read(_LONGEST).strip():
            raise ProgramError("the file is empty", file=file, expected="a pentapod program")
        raise ProgramError("not a pentapod program", file=file, line=1, expected=f"# {MAGIC} = {FORMAT_VERSION}")
    while line.startswith(b"#"):
        if len(line) >= _LONGEST or len(lines) >= _MOST_LINES:
            what = "the header is longer than any"
            raise ProgramError(what, file=file, line=len(lines) + 1, expected=f"at most {_MOST_LINES} lines")
        if not line.endswith(b"\n"):
            raise ProgramError("the file ends within the header", file=file, line=len(lines) + 1)
        try:
            lines.append(line[:-1].decode())
        except UnicodeDecodeError as error:
            raise ProgramError("not a pentapod program: not UTF-8 text", file=file, line=len(lines) + 1) from error
        line = source.readline(_LONGEST)
    header = parse_header(lines, file)
    names = line.decode(errors="replace").rstrip("\r\n")
    if names != COLUMNS:
        raise ProgramError("wrong column names", file=file, line=len(lines) + 1, value=names[:80], expected=COLUMNS)
    return header, len(lines) + 2
