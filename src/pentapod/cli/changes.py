"""Other values of keys on the command line: `--set feed.cut_mm_min=1200`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pentapod.job.schema.job import Job


CHANGED_JOB = "changed-job.toml"
"""Name of the job file of a run with other values, in the run's folder."""


def changed(job: Job, changes: Sequence[str], folder: Path) -> Job:
    """Return the job with other values, TABLE.KEY=VALUE each, from a job file that is written into the run's folder.

    A value is TOML, or a word. Raises InputError.
    """
    from pentapod.job.schema.written_job import write_job

    values = dict(_parsed(text) for text in changes)
    if not values:
        return job
    content = job.with_(**values).tables.model_dump(mode="json", exclude_unset=True)
    return write_job(job, content, folder / CHANGED_JOB, f"with {', '.join(changes)}")


def written_before(folder: Path) -> bytes | None:
    """Return the job with other values that a run's folder has already."""
    file = folder / CHANGED_JOB
    return file.read_bytes() if file.is_file() else None


def withdraw(folder: Path, before: bytes | None) -> None:
    """Leave a run's folder as it was before `changed`: with its job of then, or without; no empty folder stays."""
    file = folder / CHANGED_JOB
    if before is not None:
        file.write_bytes(before)
    elif file.is_file():
        file.unlink()
        if not any(folder.iterdir()):
            folder.rmdir()


def _parsed(text: str) -> tuple[str, Any]:
    """Return the path of a key and its value."""
    import tomllib

    from pentapod.base.errors import InputError

    path, equals, value = text.partition("=")
    if not equals or path.count(".") != 1 or not all(path.strip().split(".")):
        expected = "TABLE.KEY=VALUE, such as feed.cut_mm_min=1200"
        raise InputError("not a change of a key", key="--set", value=text, expected=expected)
    try:
        return path.strip(), tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return path.strip(), value.strip()  # a word needs no quotes
