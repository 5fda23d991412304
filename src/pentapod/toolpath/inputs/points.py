"""Polylines from the points of a CSV file."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError, nearest
from pentapod.toolpath.formats.reading import number, read_lines
from pentapod.toolpath.inputs.files import LIMITS

_COUNT_REMARK = re.compile(r"#\s*points\s*=\s*([0-9]{1,12})")

UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "inch": 25.4e-3}


def read_points(path: str | Path) -> list[Floats]:
    """Return the polylines (n, 3), metres, of a CSV file.

    The first row names the columns with their unit: x_mm, y_mm, z_mm (or cm, m, inch), and optionally `line`. A new
    polyline begins where the value of `line` changes, and after an empty row. Lines that begin with # are remarks; with
    "# points = 120" a file of another number of rows is refused. Raises ToolpathError with file and line.

    >>> [line.shape for line in read_points("line.csv")]  # x_mm,y_mm,z_mm
    [(2, 3)]
    """
    path = Path(path)
    columns: dict[str, tuple[int, float]] | None = None
    lines: list[list[list[float]]] = [[]]
    name, announced = "", None
    for line, row in _rows(path, read_lines(path, "a CSV file of points", LIMITS.file_bytes)):
        if row and row[0].lstrip().startswith("#"):
            announced = _COUNT_REMARK.fullmatch(row[0].strip()) or announced
            continue
        if not any(cell.strip() for cell in row):
            lines.append([])
            continue
        if columns is None:
            columns = _columns(path, line, row)
            continue
        if len(row) != len(columns):
            what = "the row has another number of columns than the first"
            raise ToolpathError(what, file=path, line=line, value=len(row), expected=str(len(columns)))
        if "line" in columns and row[columns["line"][0]].strip() != name:
            name = row[columns["line"][0]].strip()
            lines.append([])
        lines[-1].append([number(row[columns[axis][0]], path, line, axis) * columns[axis][1] for axis in "xyz"])
    count = sum(map(len, lines))
    if announced is not None and int(announced[1]) != count:
        what = "the number of rows is not that of the remark: the file was cut off or rows were added"
        raise ToolpathError(what, file=path, key="points", value=count, expected=announced[1])
    found = [np.array(line) for line in lines if len(line) > 1]
    if not found:
        raise ToolpathError("the file holds no polyline", file=path, expected="at least two rows of numbers in a line")
    return found


def _columns(path: Path, number: int, row: list[str]) -> dict[str, tuple[int, float]]:
    """Return the index and the unit of each column by its quantity. Raises ToolpathError: unknown, missing or twice."""
    known = [f"{axis}_{unit}" for axis in "xyz" for unit in UNITS] + ["line"]
    columns: dict[str, tuple[int, float]] = {}
    for place, cell in enumerate(row):
        key = cell.strip()
        if key not in known:
            raise ToolpathError("unknown column", file=path, line=number, value=key, remedy=nearest(key, known))
        what, _, unit = key.partition("_")
        if what in columns:
            raise ToolpathError("the column is there twice", file=path, line=number, value=key)
        columns[what] = (place, UNITS.get(unit, 1.0))
    missing = [axis for axis in "xyz" if axis not in columns]
    if missing:
        names = ", ".join(f"{axis}_mm" for axis in missing)
        raise ToolpathError("a column is missing", file=path, line=number, expected=names)
    return columns


def _rows(path: Path, lines: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Yield the cells of each line, with its number. Raises ToolpathError where it is no row of a CSV file."""
    reader = csv.reader(lines, strict=True)
    try:
        for row in reader:
            yield reader.line_num, row
    except csv.Error as error:
        what = f"not a row of a CSV file: {error}"
        raise ToolpathError(what, file=path, line=max(reader.line_num, 1), remedy="export it again") from error
