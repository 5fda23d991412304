"""Artefacts: names of the files of a run, and their writers."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterable, Mapping
from itertools import chain
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from pentapod.base.errors import InputError
from pentapod.base.files import atomic_write, pack_arrays
from pentapod.job.ways.names import FILES as WAYS

PROGRAM, VERDICT, REPORT, ARRAYS = "program.csv", "verdict.json", "report.html", "plan.npz"
SHEET = "sheet.html"
"""The set-up sheet, where there is a program."""

WITHHELD = "withheld.csv"
"""A program that fails its own verdict: to be looked at, never to be run."""

MANIFEST = "manifest.json"
NAMES = (PROGRAM, *WAYS.values(), WITHHELD, ARRAYS, REPORT, SHEET, VERDICT, MANIFEST)
"""In the order in which they are moved into the folder; the manifest is last and marks a complete run."""

SETUPS = "setup-[1-9]*"
"""Folders of the same files, one for each set-up of a job that needs several."""


def check_folder(folder: Path) -> None:
    """Raise InputError where the folder cannot be made or written. Nothing is left behind."""
    existing = folder
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    try:
        with tempfile.TemporaryFile(dir=existing):
            pass
    except OSError as error:
        reason = "not a folder" if existing.is_file() else (error.strerror or str(error)).lower()
        raise InputError(
            f"the output folder cannot be written: {reason}", file=folder, remedy="choose another with -o"
        ) from error


def write_json(content: Mapping[str, Any], path: Path) -> None:
    """Write indented JSON atomically. NaN is an error: JSON has none."""
    text = json.dumps(content, indent=2, allow_nan=False, ensure_ascii=False)
    with atomic_write(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def write_arrays(parts: Iterable[Mapping[str, NDArray[Any]]], path: Path) -> None:
    """Write an .npz of arrays by name, one part after the other, atomically; its bytes depend on the arrays alone."""
    with atomic_write(path) as temporary, temporary.open("wb") as file:
        pack_arrays(chain.from_iterable(part.items() for part in parts), file)
