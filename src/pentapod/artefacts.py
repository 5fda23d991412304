"""The folder of a run: its files are all of one run that ended, or those that stood there before."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from pentapod.errors import InputError
from pentapod.files import atomic_write, packed_arrays

PROGRAM, VERDICT, REPORT, ARRAYS = "program.csv", "verdict.json", "report.html", "plan.npz"
NAMES = (PROGRAM, ARRAYS, REPORT, VERDICT)
"""In the order in which they move into the folder: the verdict comes last and stands for all."""

SETUPS = "setup-[1-9]*"
"""Folders of the same files, one for each set-up of a job that needs several."""

_UNFINISHED = ".unfinished-"


def check_folder(folder: Path) -> None:
    """Raise InputError where the folder cannot be made or written; makes nothing that stays."""
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


@contextmanager
def staged(folder: Path) -> Generator[Path]:
    """Yield a new folder inside `folder`; what was written there moves into `folder` when the block ends.

    Files of an earlier run that this one did not write are removed (a refused job leaves no old program).
    When the block raises, also on KeyboardInterrupt, everything is as it was before.
    """
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    staging = Path(tempfile.mkdtemp(prefix=_UNFINISHED, dir=folder))
    try:
        yield staging
        (folder / VERDICT).unlink(missing_ok=True)  # until the new one is there, no verdict is better than the old
        for old in folder.glob(SETUPS):
            shutil.rmtree(old, ignore_errors=True)
        for new in staging.glob(SETUPS):
            new.replace(folder / new.name)
        for name in NAMES:
            if (staging / name).exists():
                (staging / name).replace(folder / name)
            else:
                (folder / name).unlink(missing_ok=True)
    except BaseException:
        shutil.rmtree(staging, ignore_errors=True)
        for path in made:
            if path.exists() and not any(path.iterdir()):
                path.rmdir()
        raise
    shutil.rmtree(staging, ignore_errors=True)


def unstaged(folder: Path) -> Path:
    """Return where a folder within a staged one will stand in the end."""
    return Path(*(part for part in folder.parts if not part.startswith(_UNFINISHED)))


def write_json(content: Mapping[str, Any], path: Path) -> None:
    """Write JSON that a person can read, atomically. NaN is an error, for JSON has none."""
    text = json.dumps(content, indent=2, allow_nan=False, ensure_ascii=False)
    with atomic_write(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def write_arrays(arrays: Mapping[str, NDArray[Any]], path: Path) -> None:
    """Write an .npz, atomically; the same arrays give the same bytes."""
    with atomic_write(path) as temporary:
        temporary.write_bytes(packed_arrays(arrays))
