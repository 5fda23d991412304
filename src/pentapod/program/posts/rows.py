"""Checks of every reader of a post: header, number of rows, leg lengths."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pentapod.base.archives import check_array
from pentapod.base.arrays import Floats
from pentapod.base.errors import ProgramError
from pentapod.base.files import read_bytes
from pentapod.program.csv_rows import POWER
from pentapod.program.header import Header
from pentapod.program.header_reader import parse_header
from pentapod.program.program import Program
from pentapod.program.resolution import LARGEST_M, quantised


def read_file(path: Path) -> bytes:
    """Return the bytes of a file of a post. Raises ProgramError where it cannot be read."""
    return read_bytes(path, ProgramError, "a file of this post")


def header_of(lines: list[str], file: Path) -> Header:
    """Return the header in lines that begin with "#". Raises ProgramError with file and line, also for no lines."""
    if not lines:
        raise ProgramError("there is no header", file=file, line=1, remedy="write the post again")
    return parse_header(lines, file)


def check_rows(rows: int, header: Header, file: Path) -> None:
    """Raise ProgramError where the number of rows is not that of the header."""
    if rows != header.rows:
        what = "the number of rows is not that of the header: the file was cut off or rows were added"
        raise ProgramError(what, file=file, value=rows, expected=str(header.rows))


def check_legs(legs: Floats, file: Path) -> Floats:
    """Return leg lengths (N, n), metres, at the resolution of programs. Raises ProgramError for impossible ones."""
    wrong = ~((legs > 0.0) & (legs <= LARGEST_M))
    if wrong.any():
        row, leg = (int(k) for k in np.argwhere(wrong)[0])
        what, value = f"a leg length that no machine has (row {row + 1})", float(legs[row, leg])
        raise ProgramError(what, file=file, key=f"leg {leg + 1}", value=value, expected="between 0 and 10 km")
    return quantised(legs)


def check_power(power: Floats | None, header: Header, file: Path) -> Floats | None:
    """Return the laser's power (N,), or None for none. Raises ProgramError where the header says otherwise."""
    if (power is None) == header.powered:
        what = "the laser's power is missing" if header.powered else "the header has no laser power"
        raise ProgramError(what, file=file, key=POWER, remedy="write the post again")
    if power is not None and not ((power >= 0.0) & (power <= 1.0)).all():
        raise ProgramError("not a share of the laser's full power", file=file, key=POWER, expected="0 to 1")
    return power


def of_archive(header: NDArray[Any], legs_mm: NDArray[Any], power: NDArray[Any] | None, file: Path) -> Program:
    """Return the program of an archive: header's text, legs (N, n) in mm, the laser's power. Raises ProgramError."""
    check_array(header, "header", file, ProgramError, "U", ())
    found = header_of(str(header).splitlines(), file)
    check_array(legs_mm, "legs_mm", file, ProgramError, "fi", (None, found.legs))
    check_rows(len(legs_mm), found, file)
    if power is not None:
        check_array(power, POWER, file, ProgramError, "fi", (len(legs_mm),))
    return found.program(check_legs(legs_mm / 1e3, file), check_power(power, found, file))
