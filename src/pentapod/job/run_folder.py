"""Transactional output folder with a manifest: all files are of one finished run, or all of the run before.

    DIR/.unfinished-PID-…   what a run writes; its end is one rename to
    DIR/.finished           a whole run with its manifest: from now on it is the run of this folder
    DIR/program.csv …       its files at their places; those of the run before are removed first

A run killed before that rename has changed nothing. After it, the next command that opens the folder moves the
remaining files. Files of the user are not touched. manifest.json has the SHA-256 of the files, so that a mix of two
runs is noticed.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import secrets
import shutil
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any, cast

from pentapod.base.errors import InputError
from pentapod.base.files import sha256_of, unwritable
from pentapod.job.artefacts import MANIFEST, NAMES, SETUPS, write_json

try:
    import fcntl as _fcntl

    fcntl: ModuleType | None = _fcntl
except ModuleNotFoundError:  # a system without such locks
    fcntl = None

_FINISHED = ".finished"
_UNFINISHED = re.compile(r"\.unfinished-(?:(\d+)-)?[a-z0-9_]{8}")


@contextmanager
def staged(folder: Path) -> Generator[Path]:
    """Yield a new folder inside `folder`; its files become the run of `folder` when the block ends.

    Files of an earlier run are removed (a refused job leaves no old program). When the block raises, also on
    KeyboardInterrupt and SystemExit, nothing has changed. Remains of killed runs are removed first. Raises InputError
    where another run is writing into the folder, or it cannot be written.
    """
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    with locked(folder, make=True) as alone:
        try:
            if alone:
                _complete(folder)
                remove_unfinished(folder)
            yield from _transaction(folder)
        except BaseException:
            for path in made:
                with contextlib.suppress(OSError):  # not empty
                    path.rmdir()
            raise


def _transaction(folder: Path) -> Generator[Path]:
    staging = folder / f".unfinished-{os.getpid()}-{secrets.token_hex(4)}"
    try:
        try:
            staging.mkdir()
        except OSError as error:
            raise unwritable(folder, error) from error
        try:
            yield staging
            write_manifest(staging)
        except InputError as error:
            if error.file is None or staging not in Path(error.file).parents:
                raise
            raise _with_final_name(error) from error
        for relative in _run_files(staging):
            if (folder / relative).is_dir():
                raise InputError("a file of the run cannot be written: a folder has its name", file=folder / relative)
        _sync(staging)
        try:
            staging.rename(folder / _FINISHED)
            _complete(folder)
        except BaseException:
            _complete(folder)  # an interruption must not leave half of the files
            raise
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def unstaged(folder: Path) -> Path:
    """Return the final path of a folder within a staged one."""
    return Path(*(part for part in folder.parts if not _UNFINISHED.fullmatch(part)))


def check_run(folder: Path) -> None:
    """Raise InputError where the files of a run's folder, or of one of its set-ups, are not of one run.

    A killed run is completed first. A folder without a manifest is not checked.
    """
    for whole in (folder, folder.parent):
        if (whole / _FINISHED / MANIFEST).is_file():
            with locked(whole):
                _complete(whole)
    if changed := _changed_files(folder):
        raise InputError(
            "files were changed since the run, or are of different runs", file=folder,
            value=", ".join(changed), expected=f"what {MANIFEST} says", remedy="plan the job again",
        )  # fmt: skip


def tidied(folder: Path, *, is_new: bool) -> None:
    """Complete or remove what a killed run left in a folder; is_new: that run made the folder, which goes if empty."""
    if folder.is_dir():
        with locked(folder):
            _complete(folder)
            remove_unfinished(folder)
        if is_new:
            with contextlib.suppress(OSError):  # not empty
                folder.rmdir()


@contextmanager
def locked(folder: Path, *, make: bool = False) -> Generator[bool]:
    """Hold the folder's lock; yield False where the file system has none. Raises InputError where another holds it.

    The lock is the system's, on the folder itself: it ends with the process.
    """
    while True:
        try:
            if make:
                folder.mkdir(parents=True, exist_ok=True)
            handle = None if fcntl is None else os.open(folder, os.O_RDONLY)
        except OSError as error:
            raise unwritable(folder, error) from error
        if fcntl is None or handle is None:
            yield False
            return
        try:
            held = _try_lock(handle, folder)
            # The process that held it before may have removed the folder.
            there = folder.exists() and os.path.samestat(folder.stat(), os.fstat(handle))
            if there or not make:
                yield held
                return
        finally:
            os.close(handle)


def _try_lock(handle: int, folder: Path) -> bool:
    """Take the lock of an open folder; return False where there are no locks. Raises InputError: another holds it."""
    if fcntl is None:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        found = (_UNFINISHED.fullmatch(path.name) for path in folder.glob(".unfinished-*"))
        by = ", ".join(sorted({f"process {match[1]}" for match in found if match and match[1]}))
        raise InputError(
            "another run is writing into this folder", file=folder, value=by or None,
            remedy="wait until it has ended, or choose another folder with -o",
        ) from error  # fmt: skip
    except OSError:
        return False
    return True


def remove_unfinished(folder: Path) -> None:
    """Remove unfinished folders of killed runs; the lock shows that those runs have ended."""
    for path in folder.glob(".unfinished-*"):
        if path.is_dir() and not path.is_symlink() and _UNFINISHED.fullmatch(path.name):
            shutil.rmtree(path, ignore_errors=True)


def _complete(folder: Path) -> None:
    """Move the files of a finished run to their places; after a kill, the remaining ones.

    All old files are removed before the first new one is moved.
    """
    finished = folder / _FINISHED
    if (finished / MANIFEST).is_file():  # it is moved last
        coming = _run_files(finished)
        kept = {Path(name) for name in _read_manifest(finished)} - set(coming)  # moved already
        for relative in reversed(_run_files(folder)):
            if relative not in kept:
                (folder / relative).unlink()
        for old in folder.glob(SETUPS):
            with contextlib.suppress(OSError):  # files of the user are there
                old.rmdir()
        for relative in coming:
            (folder / relative).parent.mkdir(exist_ok=True)
            (finished / relative).replace(folder / relative)
        _sync(folder)
    shutil.rmtree(finished, ignore_errors=True)


def _with_final_name(error: InputError) -> InputError:
    """Return an error about a staged file with the name of the final file."""
    return type(error)(
        error.what, file=unstaged(Path(error.file or "")), key=error.key, line=error.line, column=error.column,
        value=error.value, expected=error.expected, remedy=error.remedy,
    )  # fmt: skip


def _sync(folder: Path) -> None:
    """Flush the entries of a folder to the disk, so that their order survives a power failure."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _run_files(folder: Path) -> list[Path]:
    """Return the files of a run that are in a folder, relative to it, those of set-ups first, manifests last."""
    parts = [*sorted(path for path in folder.glob(SETUPS) if path.is_dir()), folder]
    return [(part / name).relative_to(folder) for part in parts for name in NAMES if (part / name).is_file()]


def write_manifest(folder: Path) -> None:
    """Write manifest.json of a run's folder, and first that of each of its set-ups."""
    for part in sorted(path for path in folder.glob(SETUPS) if path.is_dir()):
        write_manifest(part)
    files = [relative for relative in _run_files(folder) if relative != Path(MANIFEST)]
    entries = {
        relative.as_posix(): {"sha256": sha256_of(folder / relative), "bytes": (folder / relative).stat().st_size}
        for relative in sorted(files)
    }
    write_json({"files": entries}, folder / MANIFEST)


def _read_manifest(folder: Path) -> dict[str, tuple[str, int]]:
    """Return SHA-256 and size of each file by name; {} where there is no manifest. Raises InputError: broken."""
    file = folder / MANIFEST
    try:
        entries = cast("dict[str, dict[str, Any]]", json.loads(file.read_text(encoding="utf-8"))["files"])
        return {name: (str(entry["sha256"]), int(entry["bytes"])) for name, entry in entries.items()}
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(
            "not the manifest of a run, or a broken one", file=file, remedy="plan the job again"
        ) from error


def _changed_files(folder: Path) -> list[str]:
    """Return the names of files that are not as manifest.json says, or not there. Raises InputError: broken."""
    return [name for name, entry in _read_manifest(folder).items() if not _is(folder / name, *entry)]


def _is(path: Path, sha256: str, size: int) -> bool:
    """Whether a file is there with these bytes; its size is compared first."""
    try:
        return path.stat().st_size == size and sha256_of(path) == sha256
    except OSError:
        return False
