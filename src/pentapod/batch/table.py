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
from pentapod.batch.tasks.task import Row

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


def lines_text(rows: Sequence[Row], last: Sequence[str]) -> str:
    """Return rows as JSON Lines: the columns of the CSV, then nested ones, their keys sorted."""
    names, lines = columns(rows, last), list[str]()
    for row in rows:
        plain = {name: row.get(name) for name in names}
        nested = {name: dict(sorted(row[name].items())) for name in sorted(row) if isinstance(row[name], Mapping)}
        lines.append(json.dumps({**plain, **nested}, ensure_ascii=False, allow_nan=False) + "\n")
    return "".join(lines)


def write_tables(rows: Sequence[Row], last: Sequence[str], folder: Path, *, parquet: bool = False) -> list[Path]:
    """Write the tables into a folder and return their paths. parquet: a third one, which needs pyarrow.

    Raises InputError where pyarrow is missing, or the folder cannot be written.
    """
    texts = {CSV: csv_text(rows, last), LINES: lines_text(rows, last)}
    for name, text in texts.items():
        with atomic_write(folder / name) as temporary:
            temporary.write_text(text, encoding="utf-8")
    written = [folder / name for name in texts]
    return [*written, _write_parquet(rows, last, folder / PARQUET)] if parquet else written


def parquet_library() -> list[Any]:
    """Return pyarrow, and its module of Parquet files. Raises InputError where it is missing."""
    what = "Parquet files need pyarrow, which is not installed"
    return [load_extra(module, "parquet", what) for module in ("pyarrow", "pyarrow.parquet")]


def _write_parquet(rows: Sequence[Row], last: Sequence[str], path: Path) -> Path:
    pyarrow, parquet = parquet_library()
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
