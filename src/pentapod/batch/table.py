"""Tables of a batch: table.csv, table.jsonl, table.parquet; a row for each task, in the order of the tasks."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pentapod.base.display import load_extra
from pentapod.base.files import atomic_write
from pentapod.batch.task import Row

CSV, LINES, PARQUET = "table.csv", "table.jsonl", "table.parquet"


def columns(rows: Sequence[Row], last: Sequence[str]) -> list[str]:
    """Return the names of the plain columns: what was known of the tasks first, then `last`."""
    found = dict.fromkeys(key for row in rows for key, value in row.items() if not isinstance(value, Mapping))
    return [*(key for key in found if key not in last), *last]


def csv_text(rows: Sequence[Row], last: Sequence[str]) -> str:
    """Return rows as CSV: a header, numbers with all their digits, lists as JSON, nothing for None."""
    names, text = columns(rows, last), io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([_cell(row.get(name)) for name in names] for row in rows)
    return text.getvalue()


def lines_text(rows: Sequence[Row]) -> str:
    """Return rows as JSON Lines, with their nested columns."""
    return "".join(f"{json.dumps(row, ensure_ascii=False, allow_nan=False)}\n" for row in rows)


def write_tables(rows: Sequence[Row], last: Sequence[str], folder: Path, *, parquet: bool = False) -> list[Path]:
    """Write the tables into a folder and return their paths. parquet: a third one, which needs pyarrow.

    Raises InputError where pyarrow is missing, or the folder cannot be written.
    """
    texts = {CSV: csv_text(rows, last), LINES: lines_text(rows)}
    for name, text in texts.items():
        with atomic_write(folder / name) as temporary:
            temporary.write_text(text, encoding="utf-8")
    written = [folder / name for name in texts]
    return [*written, _write_parquet(rows, last, folder / PARQUET)] if parquet else written


def parquet_library() -> Any:
    """Return pyarrow. Raises InputError where it is missing."""
    return load_extra("pyarrow.parquet", "parquet", "Parquet files need pyarrow, which is not installed")


def _write_parquet(rows: Sequence[Row], last: Sequence[str], path: Path) -> Path:
    parquet = parquet_library()
    import pyarrow  # noqa: PLC0415

    names = columns(rows, last)
    data = {name: _alike([_plain(row.get(name)) for row in rows]) for name in names}
    with atomic_write(path) as temporary:
        parquet.write_table(pyarrow.table(data), temporary)
    return path


def _alike(values: list[Any]) -> list[Any]:
    """Return values of one type: numbers, or texts where some are none."""
    kinds = {type(value) for value in values if value is not None}
    if len(kinds) < 2:
        return values
    kind = float if kinds <= {int, float} else str
    return [None if value is None else kind(value) for value in values]


def _plain(value: Any) -> Any:
    return json.dumps(value, ensure_ascii=False) if isinstance(value, list | tuple) else value


def _cell(value: Any) -> str:
    value = _plain(value)
    if value is None:
        return ""
    return value if isinstance(value, str) else json.dumps(value)
