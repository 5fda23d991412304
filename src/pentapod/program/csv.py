"""Program files: a header, then `time_s,leg1_mm,…,leg5_mm`, one row each period. Writer and reader."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from pentapod.arrays import Floats
from pentapod.errors import ProgramError
from pentapod.files import atomic_write
from pentapod.program.header import MAGIC, Header, header_text, parse_header
from pentapod.program.program import FORMAT_VERSION, Program
from pentapod.program.resolution import LARGEST_M, MM_DECIMALS, from_millimetres, to_millimetres

COLUMNS = "time_s,leg1_mm,leg2_mm,leg3_mm,leg4_mm,leg5_mm"
_CHUNK = 20_000


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
    """Return the program in a file, bit for bit as it was sampled. Raises ProgramError with file and line.

    Refused are: what is no program, an unknown format version, a header with a key missing or wrong, a
    truncated file, a wrong number of columns or rows, NaN, and rows whose time is not k · period.
    """
    file = Path(path)
    try:
        data = file.read_bytes()
    except OSError as error:
        raise ProgramError(f"cannot be read: {(error.strerror or str(error)).lower()}", file=file) from error
    header, first_line, body = _split(data, file)
    return Program(
        period=header.period,
        legs=_legs(body, header, first_line, file),
        interpolation=header.interpolation,
        component=header.component,
        placement=header.placement,
        provenance=header.provenance,
    )


def _pieces(program: Program) -> Iterator[bytes]:
    """Yield the file in pieces, so that a long program is never in memory as text as a whole."""
    decimals = _time_decimals(program.period)
    row = f"%.{decimals}f" + f",%.{MM_DECIMALS}f" * 5 + "\n"
    yield (header_text(program) + COLUMNS + "\n").encode()
    for start in range(0, len(program.legs), _CHUNK):
        legs = to_millimetres(program.legs[start : start + _CHUNK])
        times = np.arange(start, start + len(legs)) * program.period
        table = np.column_stack([times, legs])
        yield ((row * len(table)) % tuple(table.ravel().tolist())).encode()


def _time_decimals(period: float) -> int:
    """Return 6 where the period is a whole number of microseconds, else 9: enough to number the rows."""
    return 6 if abs(period * 1e6 - round(period * 1e6)) < 1e-9 else 9


def _split(data: bytes, file: Path) -> tuple[Header, int, bytes]:
    """Return the header, the line number of the first row, and the rows."""
    if not data.strip():
        raise ProgramError("the file is empty", file=file, expected="a pentapod program")
    if not data.startswith(b"#"):
        raise ProgramError("not a pentapod program", file=file, line=1, expected=f"# {MAGIC} = {FORMAT_VERSION}")
    lines: list[str] = []
    position = 0
    while data.startswith(b"#", position):
        end = data.find(b"\n", position)
        if end < 0:
            raise ProgramError("the file ends within the header", file=file, line=len(lines) + 1)
        try:
            lines.append(data[position:end].decode())
        except UnicodeDecodeError as error:
            raise ProgramError("not a pentapod program: not UTF-8 text", file=file, line=len(lines) + 1) from error
        position = end + 1
    header = parse_header(lines, file)
    end = data.find(b"\n", position)
    names = data[position : end if end >= 0 else len(data)].decode(errors="replace").rstrip("\r")
    if names != COLUMNS:
        raise ProgramError("wrong column names", file=file, line=len(lines) + 1, value=names[:80], expected=COLUMNS)
    return header, len(lines) + 2, data[end + 1 :] if end >= 0 else b""


def _legs(body: bytes, header: Header, first_line: int, file: Path) -> Floats:
    """Return leg lengths (rows, 5) in metres."""
    if body and not body.endswith(b"\n"):
        raise ProgramError(
            "the file ends within a row",
            file=file,
            line=first_line + body.count(b"\n"),
            remedy="it was truncated",
        )
    if body.count(b"\n") == 0:
        raise ProgramError("there are no rows", file=file, line=first_line, expected=f"{header.rows} rows")
    try:
        table: Any = np.loadtxt(io.BytesIO(body), delimiter=",", comments=None, ndmin=2, encoding="latin-1")
    except ValueError:
        _blame_row(body, first_line, file)
    if table.shape[1] != 6 or len(table) != body.count(b"\n") or not np.isfinite(table).all():
        _blame_row(body, first_line, file)
    _check_times(table[:, 0], header.period, first_line, file)
    if len(table) != header.rows:
        raise ProgramError(
            "the number of rows is not that of the header: the file was truncated or rows were added",
            file=file,
            line=first_line + len(table) - 1,
            key="rows",
            value=len(table),
            expected=str(header.rows),
        )
    wrong = (table[:, 1:] <= 0.0) | (table[:, 1:] > 1e3 * LARGEST_M)
    if wrong.any():
        row, leg = np.argwhere(wrong)[0]
        raise ProgramError(
            "a leg length that no machine has",
            file=file,
            line=first_line + int(row),
            key=f"leg{leg + 1}_mm",
            value=float(table[row, leg + 1]),
            expected="between 0 and 10 km",
        )
    return from_millimetres(table[:, 1:])


def _check_times(times: Floats, period: float, first_line: int, file: Path) -> None:
    """Raise ProgramError at the first row k whose time is not k · period to half a unit of the last digit."""
    expected = np.arange(len(times)) * period
    tolerance = 0.51 * 10.0 ** -_time_decimals(period) + 1e-12 * expected
    wrong = np.abs(times - expected) > tolerance
    if not wrong.any():
        return
    row = int(np.argmax(wrong))
    steps = (times[row] - times[row - 1]) / period if row else np.inf
    if row and steps < 0.5:
        what = "the rows are out of order"
    elif row and abs(steps - round(steps)) < 1e-3:
        what = f"{round(steps) - 1} rows are missing before this one"
    else:
        what = "the time is not a multiple of the period"
    raise ProgramError(
        what, file=file, line=first_line + row, value=float(times[row]), expected=f"{expected[row]:.9g} s"
    )


def _blame_row(body: bytes, first_line: int, file: Path) -> NoReturn:
    """Raise ProgramError at the first row that is not six finite numbers."""
    for number, line in enumerate(body.split(b"\n")[:-1], start=first_line):
        fields = line.split(b",")
        if len(fields) != 6:
            raise ProgramError("wrong number of columns", file=file, line=number, value=len(fields), expected="6")
        for name, field in zip(COLUMNS.split(","), fields, strict=True):
            text = field.decode(errors="replace").strip()
            if not _finite(text):
                raise ProgramError("not a finite number", file=file, line=number, key=name, value=text[:40])
    raise ProgramError("the rows cannot be read", file=file, line=first_line)


def _finite(text: str) -> bool:
    try:
        return bool(np.isfinite(float(text))) and "_" not in text
    except ValueError:
        return False
