"""Calibration files: a `CalibrationRecord` as TOML, read and written."""

from __future__ import annotations

import datetime
import json
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError, create_model

from pentapod.base.errors import MachineError
from pentapod.base.files import atomic_write
from pentapod.base.keys import declared, fields_from
from pentapod.base.tables import TomlTable, problem_of, table_of
from pentapod.base.toml import line_of, parsed, read_toml
from pentapod.machine.calibration.record import CalibrationFit, CalibrationRecord, MeasuredGeometry, in_file

_DIGEST = r"^[0-9a-f]{16}$"
_PARTS: dict[str, type] = {"geometry": MeasuredGeometry, "fit": CalibrationFit}
_MODELS: dict[str, Any] = {name: table_of(part) for name, part in _PARTS.items()}
_FILE_KEYS = {item.field: f"{name}.{item.file_key}" for name, part in _PARTS.items() for item in declared(part)}
_HEAD = "# A machine's geometry as measured; [calibration] of a machine file names this file.\n"


class RecordTable(TomlTable):
    """A calibration file."""

    machine: Annotated[str, Field(min_length=1)] = Field(description="name of the machine that was measured")
    nominal: Annotated[str, Field(pattern=_DIGEST)] = Field(
        description="digest of its geometry as designed: 16 hexadecimal digits"
    )
    date: datetime.date = Field(description="day of the measurement, like 2026-01-31")
    digest: Annotated[str, Field(pattern=_DIGEST)] | None = Field(
        default=None, description="of this file's numbers: finds changes; left out in a file that is written by hand"
    )


_TABLES: dict[str, Any] = {"geometry": (_MODELS["geometry"], ...), "fit": (_MODELS["fit"] | None, None)}
CalibrationTables = create_model("CalibrationTables", __base__=RecordTable, __doc__=RecordTable.__doc__, **_TABLES)
"""A whole calibration file."""


def read_calibration(path: str | Path) -> CalibrationRecord:
    """Return the record of a calibration file. Raises MachineError: one line with file, line, key, value and remedy."""
    file = Path(path)
    text = read_toml(file, "calibration", MachineError)
    content = parsed(text, file, MachineError)
    try:
        record = _record(CalibrationTables.model_validate(content))
    except ValidationError as error:
        where, details = problem_of(error, CalibrationTables, _MODELS.get)
        raise MachineError(file=file, line=line_of(text, where), **details) from error
    except MachineError as error:
        key = _FILE_KEYS.get(error.key or "", error.key or "")
        raise MachineError(
            error.what, file=file, key=key, line=line_of(text, key.split(".")), value=error.value,
            expected=error.expected, remedy=error.remedy,
        ) from error  # fmt: skip
    given = content.get("digest")
    if given is not None and given != record.digest:
        raise MachineError(
            "numbers of this file were changed after it was written", file=file, key="digest",
            line=line_of(text, ["digest"]), value=given, expected=record.digest,
            remedy="take the file that was written, or, where the change is meant, leave the key out",
        )  # fmt: skip
    return record


def write_calibration(record: CalibrationRecord, path: str | Path) -> None:
    """Write a record as a calibration file, whole or not at all. Raises InputError where it cannot be written."""
    with atomic_write(path) as temporary:
        temporary.write_text(calibration_text(record), encoding="utf-8")


def calibration_text(record: CalibrationRecord) -> str:
    """Return a record as the text of a calibration file; what is read back equals it."""
    lines = [
        f"machine = {json.dumps(record.machine, ensure_ascii=False)}",
        f'nominal = "{record.nominal}"',
        f"date = {record.date.isoformat()}",
        f'digest = "{record.digest}"',
    ]
    for name, part in (("geometry", record.geometry), ("fit", record.fit)):
        if part is not None:
            lines += ["", f"[{name}]"]
            for item in declared(type(part)):
                lines.append(f"{item.file_key} = {_toml(getattr(part, item.field), item.key.unit)}")
    return _HEAD + "\n".join(lines) + "\n"


def _toml(value: Any, unit: str) -> str:
    """Return a number, an array or names as TOML; rows of an array on lines of their own."""
    if not unit:
        return json.dumps(list(value), ensure_ascii=False)
    plain = in_file(value, unit)
    if isinstance(plain, list) and plain and isinstance(plain[0], list):
        return "[\n" + "".join(f"  {json.dumps(row)},\n" for row in plain) + "]"
    return json.dumps(plain)


def _record(tables: Any) -> CalibrationRecord:
    parts = {name: getattr(tables, name) for name in _PARTS}
    made = {name: _PARTS[name](**fields_from(_PARTS[name], table)) for name, table in parts.items() if table}
    return CalibrationRecord(tables.machine, tables.nominal, tables.date, **made)
