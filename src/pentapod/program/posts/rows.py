"""What every reader of a post checks: the header, the number of rows, lengths that a machine can have."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pentapod.base.archives import check_array
from pentapod.base.arrays import Floats
from pentapod.base.errors import ProgramError
from pentapod.kinematics.five_legs import FiveLegs
from pentapod.program.header import Header, parse_header
from pentapod.program.program import Program
from pentapod.program.resolution import LARGEST_M, quantised


def header_of(lines: list[str], file: Path) -> Header:
    """Return the header in lines that begin with "#". Raises ProgramError with file and line, also for no lines."""
    if not lines:
        raise ProgramError("there is no header", file=file, line=1, remedy="write the program anew")
    return parse_header(lines, file)


def check_rows(rows: int, header: Header, file: Path) -> None:
    """Raise ProgramError where the number of rows is not that of the header."""
    if rows != header.rows:
        raise ProgramError(
            "the number of rows is not that of the header: the file was cut off or rows were added",
            file=file,
            value=rows,
            expected=str(header.rows),
        )


def check_legs(legs: Floats, file: Path) -> Floats:
    """Return leg lengths (N, n), metres, at the resolution of programs. Raises ProgramError: no machine has one so."""
    wrong = ~((legs > 0.0) & (legs <= LARGEST_M))
    if wrong.any():
        row, leg = (int(k) for k in np.argwhere(wrong)[0])
        raise ProgramError(
            f"a leg length that no machine has (row {row + 1})",
            file=file,
            key=f"leg {leg + 1}",
            value=float(legs[row, leg]),
            expected="between 0 and 10 km",
        )
    return quantised(legs)


def of_archive(header: NDArray[Any], legs_mm: NDArray[Any], file: Path) -> Program:
    """Return the program of an archive: its header's text and its legs (N, n), millimetres. Raises ProgramError."""
    check_array(header, "header", file, ProgramError, "U", ())
    check_array(legs_mm, "legs_mm", file, ProgramError, "fi", (None, FiveLegs.n_legs))
    found = header_of(str(header).splitlines(), file)
    check_rows(len(legs_mm), found, file)
    return found.program(check_legs(legs_mm / 1e3, file))
