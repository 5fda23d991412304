"""Measurement files: a header of `# key = value` lines, then a row for each pose; read and written.

`pentapod calibrate plan` writes one with the legs of the chosen poses and empty cells for what the instrument sees.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError, MachineError, nearest
from pentapod.base.files import atomic_write, number_in, read_bytes
from pentapod.base.units import from_si, split_key, to_si
from pentapod.kinematics.component import Component
from pentapod.machine.calibration.parameters import LEGS
from pentapod.machine.identification.measurements import Frame, Instrument, Measurements

MAGIC, VERSION = "pentapod_measurements", 1
LEG_COLUMNS = tuple(f"leg{leg}_mm" for leg in range(1, LEGS + 1))
_POSITION, _AXIS, _SETUP = ("x_mm", "y_mm", "z_mm"), ("i", "j", "k"), "setup"
SEEN_COLUMNS = {
    Instrument.POSE: (*_POSITION, *_AXIS),
    Instrument.DOCK: (*_POSITION, *_AXIS),
    Instrument.TRACKER: _POSITION,
    Instrument.PLATE: _POSITION,
    Instrument.BALLBAR: ("distance_mm",),
}
"""What an instrument sees, by columns; the tool axis i, j, k points from the tip to the spindle."""

_KEYS: dict[str, type] = {
    MAGIC: int,
    "instrument": str,
    "machine": str,
    "nominal": str,
    "component": str,
    "frame": str,
    "target_mm": float,
    "leg_sigma_mm": float,
    "position_sigma_mm": float,
    "direction_sigma_deg": float,
}
_OPTIONAL = ("leg_sigma_mm", "direction_sigma_deg", "frame")
_LINE = re.compile(r"# ([a-z0-9_]+) = (\S.*)")

_HELP = {
    Instrument.POSE: "x_mm to z_mm: position of the target; i, j, k: tool axis, tip to spindle",
    Instrument.DOCK: "x_mm to z_mm, i, j, k: position and tool axis of the dock, in the machine's frame",
    Instrument.TRACKER: "x_mm to z_mm: position of the target; setup: station of the tracker, from 1",
    Instrument.PLATE: "x_mm to z_mm: centre of the sphere, from the plate's certificate; setup: place of the plate",
    Instrument.BALLBAR: "distance_mm: from the fixed ball's centre to the target; setup: place of the ball, from 1",
}


def columns_of(instrument: Instrument) -> tuple[str, ...]:
    """Return the names of the columns of a file."""
    setup = () if instrument.sees_axes else (_SETUP,)
    return ("pose", *setup, *LEG_COLUMNS, *SEEN_COLUMNS[instrument])


def measurements_text(measured: Measurements, *, empty: bool = False) -> str:
    """Return measurements as the text of a file. empty: what the instrument sees is left open."""
    values: dict[str, object] = {
        MAGIC: VERSION,
        "instrument": str(measured.instrument),
        "machine": measured.machine,
        "nominal": measured.digest,
        "component": str(measured.component),
        "frame": str(measured.frame),
        **{key: _rounded(getattr(measured, name), unit) for key in _KEYS for name, unit in [split_key(key)] if unit},
    }
    lines = [f"# {key} = {json.dumps(value, ensure_ascii=False)}" for key, value in values.items() if value is not None]
    lines += [f"# {_HELP[measured.instrument]}", ",".join(columns_of(measured.instrument))]
    setups = None if measured.instrument.sees_axes else measured.setups
    legs, seen = from_si(measured.legs, "mm"), _seen_in_file(measured)
    for pose in range(len(measured)):
        cells = [str(pose + 1)] + ([] if setups is None else [str(int(setups[pose]) + 1)])
        cells += [f"{length:.6f}" for length in legs[pose]]
        cells += [""] * seen.shape[1] if empty else [f"{value:.9g}" for value in seen[pose]]
        lines.append(",".join(cells))
    return "\n".join(lines) + "\n"


def write_measurements(measured: Measurements, path: str | Path, *, empty: bool = False) -> Path:
    """Write measurements, whole or not at all, and return the path. Raises InputError where it cannot be written."""
    with atomic_write(path) as temporary:
        temporary.write_text(measurements_text(measured, empty=empty), encoding="utf-8")
    return Path(path)


def is_filled_in(path: str | Path) -> bool:
    """Whether there is a measurements file with something in the cells for what the instrument sees."""
    file = Path(path)
    if not file.is_file():
        return False
    lines = [line for line in file.read_text(encoding="utf-8-sig", errors="replace").splitlines() if line[:1] != "#"]
    titles, *rows = [line.split(",") for line in lines if line.strip()] or [[]]
    first = 1 + max((k for k, name in enumerate(titles) if name.strip() in LEG_COLUMNS), default=-1)
    return any(cell.strip() for row in rows for cell in row[first:])


def read_measurements(path: str | Path) -> Measurements:
    """Return the measurements of a file; poses whose seen cells are all empty were not measured and are left out.

    Raises MachineError: one line with file, line, key or column, value and remedy.
    """
    file = Path(path)
    start = '"pentapod calibrate plan" writes one to fill in'
    try:
        lines = read_bytes(file, MachineError, "a measurements file", start=start).decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise MachineError("not a text file in UTF-8", file=file, expected="a measurements file") from error
    header, first = _header(lines, file)
    instrument = _choice(header, "instrument", Instrument, file)
    columns = columns_of(instrument)
    names = [cell.strip() for cell in lines[first].split(",")] if first < len(lines) else []
    if tuple(names) != columns:
        value, expected = ",".join(names)[:120], ",".join(columns)
        raise MachineError("wrong column names", file=file, line=first + 1, value=value, expected=expected)
    rows, numbers = _rows(lines, first + 1, columns, file)
    if not rows:
        raise MachineError("no pose was measured", file=file, remedy="fill in what the instrument saw, a row each")
    table = np.array(rows)
    legs_from = columns.index(LEG_COLUMNS[0])
    legs, seen = np.split(table[:, legs_from:], [LEGS], axis=1)
    setups = (
        np.zeros(0, dtype=np.intp) if instrument.sees_axes else _setups(table[:, columns.index(_SETUP)], numbers, file)
    )
    options = {name: to_si(header[key], unit) for key in header for name, unit in [split_key(key)] if unit}
    try:
        return Measurements(
            instrument=instrument,
            legs=to_si(legs, "mm"),
            seen=np.hstack([to_si(seen[:, :3], "mm"), seen[:, 3:]]),
            component=Component.parse(header["component"]),
            frame=_choice(header, "frame", Frame, file),
            setups=setups,
            machine=header["machine"],
            digest=header["nominal"],
            lines=np.array(numbers),
            **options,
        )
    except InputError as error:
        raise MachineError(
            error.what, file=file, key=error.key, value=error.value, expected=error.expected, remedy=error.remedy
        ) from error


def _rounded(value: float | None, unit: str) -> float | None:
    return None if value is None else float(f"{float(from_si(value, unit)):.12g}")


def _seen_in_file(measured: Measurements) -> Floats:
    return np.hstack([from_si(measured.seen[:, :3], "mm"), measured.seen[:, 3:]])


def _choice(header: dict[str, Any], key: str, kind: Any, file: Path) -> Any:
    if header[key] not in list(kind):
        known = [str(one) for one in kind]
        raise MachineError("unknown", file=file, key=key, value=header[key], remedy=nearest(header[key], known))
    return kind(header[key])


def _header(lines: list[str], file: Path) -> tuple[dict[str, Any], int]:
    """Return the values of the header and the index of the line of column names. Raises MachineError."""
    values: dict[str, Any] = {}
    first = 0
    for first, line in enumerate(lines):
        if not line.startswith("#"):
            break
        match = _LINE.fullmatch(line.strip())
        if match is None:
            continue  # a remark
        key, line_number = match[1], first + 1
        if key not in _KEYS:
            raise MachineError("unknown key", file=file, line=line_number, key=key, remedy=nearest(key, _KEYS))
        try:
            value: Any = tomllib.loads(f"value = {match[2]}")["value"]
        except tomllib.TOMLDecodeError as error:
            expected = "a number, or a text in quotes"
            raise MachineError("cannot read", file=file, line=line_number, key=key, expected=expected) from error
        kind = _KEYS[key]
        value = float(value) if kind is float and type(value) is int else value
        if type(value) is not kind:
            expected = {int: "a whole number", float: "a number", str: "a text in quotes"}[kind]
            raise MachineError("wrong value", file=file, line=line_number, key=key, value=value, expected=expected)
        values[key] = value
    missing = [key for key in _KEYS if key not in values and key not in _OPTIONAL]
    if MAGIC in missing:
        expected = f"# {MAGIC} = {VERSION}"
        remedy = '"pentapod calibrate plan" writes one to fill in'
        raise MachineError("not a measurements file", file=file, line=1, expected=expected, remedy=remedy)
    if values[MAGIC] != VERSION:
        raise MachineError("unknown format version", file=file, key=MAGIC, value=values[MAGIC], expected=str(VERSION))
    if missing:
        raise MachineError("the key is missing in the header", file=file, key=missing[0], expected=f"# {missing[0]} =")
    values.setdefault("frame", str(Frame.MACHINE))
    return values, first


def _rows(lines: list[str], first: int, columns: tuple[str, ...], file: Path) -> tuple[list[list[float]], list[int]]:
    """Return the numbers of the measured poses, and their lines. Raises MachineError at the first bad row."""
    rows, numbers = list[list[float]](), list[int]()
    seen_from = columns.index(LEG_COLUMNS[-1]) + 1
    for number, cells in _cells(lines, first):
        if len(cells) != len(columns):
            what, expected = "wrong number of columns", f"{len(columns)}: {','.join(columns)}"
            raise MachineError(what, file=file, line=number, value=len(cells), expected=expected)
        if not any(cells[seen_from:]):
            continue
        row: list[float] = []
        for name, cell in zip(columns, cells, strict=True):
            value = number_in(cell)
            if value is None:
                what = "not a finite number" if cell else "the cell is empty"
                remedy = None if cell else "fill it in, or leave all that the instrument saw of this pose empty"
                raise MachineError(what, file=file, line=number, key=name, value=cell[:40] or None, remedy=remedy)
            row.append(value)
        rows.append(row)
        numbers.append(number)
    return rows, numbers


def _cells(lines: list[str], first: int) -> Iterator[tuple[int, list[str]]]:
    for number, line in enumerate(lines[first:], start=first + 1):
        if line.strip() and not line.startswith("#"):
            yield number, [cell.strip() for cell in line.split(",")]


def _setups(values: Floats, numbers: list[int], file: Path) -> Any:
    """Return the set-ups, from 0 and without gaps. Raises MachineError."""
    wrong = (values < 1.0) | (values != np.round(values))
    if wrong.any():
        row = int(np.argmax(wrong))
        expected = "whole numbers from 1"
        raise MachineError(
            "not a set-up", file=file, line=numbers[row], key=_SETUP, value=values[row], expected=expected
        )
    return np.unique(values, return_inverse=True)[1]
