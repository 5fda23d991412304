"""The folder of a task: begun beside its place, renamed when it is whole, packed where it must travel."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path

from pentapod.base.files import atomic_write
from pentapod.batch.tasks.task import Row, Task

ROW = "row.json"
"""The row of a finished task, in its folder. It is written last."""


def write_files(task: Task, folder: Path) -> None:
    """Make the folder of a task, with its files."""
    folder.mkdir(parents=True)
    for name, text in task.files.items():
        (folder / name).write_text(text, encoding="utf-8")


def finish(staging: Path, final: Path, row: Row) -> None:
    """Write the row of a task into its folder and rename that; where another was quicker, its folder stays."""
    with atomic_write(staging / ROW) as temporary:
        text = json.dumps(row, indent=2, sort_keys=True, allow_nan=False, ensure_ascii=False)
        temporary.write_text(text + "\n", encoding="utf-8")
    try:
        staging.rename(final)
    except OSError:
        if finished_row(final) is None:
            raise


def finished_row(folder: Path) -> Row | None:
    """Return the row of a finished task; None where the folder is not one."""
    try:
        return json.loads((folder / ROW).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def unpack(data: bytes, folder: Path) -> None:
    """Write the files of a packed folder."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        archive.extractall(folder)


def packed(folder: Path) -> bytes:
    """Return the files of a folder in one piece."""
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for path in sorted(folder.rglob("*")):
            archive.write(path, path.relative_to(folder).as_posix())
    return data.getvalue()
