"""The program file itself, `time_s,leg1_mm,…` (see `pentapod.program.csv`), as a post."""

from __future__ import annotations

from pathlib import Path

from pentapod.program.csv import csv_bytes, read_csv
from pentapod.program.posts.registry import Post, PostInput, register
from pentapod.program.program import Program

_FILE = "program.csv"


def _write(given: PostInput) -> dict[str, bytes]:
    return {_FILE: csv_bytes(given.program)}


def _read(folder: Path) -> Program:
    return read_csv(folder / _FILE)


CSV = register(Post("csv", "pentapod's own program file", _write, _read))
