"""Job files that are written: of runs whose job is not the file that was given, so that programs can be verified."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from pentapod.base.files import atomic_write
from pentapod.base.toml import toml_text
from pentapod.job.schema.job import Job


def write_job(job: Job, content: dict[str, Any], file: Path, remark: str) -> Job:
    """Write tables of a job into a file, and return the job that is read from it.

    It names the same mesh, machine and files as `job`, relative to its folder. Raises InputError where it cannot be
    written, or where the tables are wrong.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    for table, key, path in job.named_files:
        content[table][key] = _relative(path, file.parent)
    with atomic_write(file) as temporary:
        head = "# " + " ".join(f"{job.path.name}, {remark}".split())  # a value may have several lines
        temporary.write_text(f"{head}\n\n{toml_text(content)}", encoding="utf-8")
    return Job.load(file)


def _relative(path: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return path.resolve().as_posix()
