"""Transactional output folder: all files are those of one finished run, or of the one before.

    DIR/.unfinished-PID-…   what a run writes; its end is one rename to
    DIR/.finished           a whole run, with its manifest: from here on it is the run of this folder
    DIR/program.csv …       where its files go; those of the run before are removed first

Killed before that rename, a run has changed nothing; killed after it, what is left to move is moved by whoever
opens the folder next. Files of two runs never stand beside each other. Files of the user are not touched.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import shutil
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

from pentapod.base.errors import InputError
from pentapod.base.files import unwritable
from pentapod.job.artefacts import MANIFEST, SETUPS
from pentapod.job.manifest import changed_files, read_manifest, run_files, write_manifest

try:
    import fcntl as _fcntl

    fcntl: ModuleType | None = _fcntl
except ModuleNotFoundError:  # a system without such locks
    fcntl = None

_FINISHED = ".finished"
_UNFINISHED = re.compile(r"\.unfinished-(?:(\d+)-)?[a-z0-9_]{8}")


@contextmanager
def staged(folder: Path) -> Generator[Path]:
    """Yield a new folder inside `folder`; what was written there is the run of `folder` when the block ends.

    Files of an earlier run that this one did not write are removed (a refused job leaves no old program). When the
    block raises, also on KeyboardInterrupt and SystemExit, everything is as it was before. What killed runs left is
    removed first. Raises InputError where another run is writing into the folder, or it cannot be written.
    """
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    with _locked(folder, make=True) as alone:
        try:
            if alone:
                _settle(folder)
                _sweep(folder)
            yield from _filled(folder)
        except BaseException:
            for path in made:
                with contextlib.suppress(OSError):  # not empty
                    path.rmdir()
            raise


def _filled(folder: Path) -> Generator[Path]:
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
            raise _of_the_folder(error) from error
        for relative in run_files(staging):
            if (folder / relative).is_dir():
                raise InputError("a file of the run cannot be written: a folder has its name", file=folder / relative)
        _sync(staging)
        try:
            staging.rename(folder / _FINISHED)
            _settle(folder)
        except BaseException:
            _settle(folder)  # the run has ended: an interruption must not leave half of its files
            raise
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def unstaged(folder: Path) -> Path:
    """Return where a folder within a staged one will stand in the end."""
    return Path(*(part for part in folder.parts if not _UNFINISHED.fullmatch(part)))


def check_run(folder: Path) -> None:
    """Raise InputError where the files of a run's folder, or of one of its set-ups, are not of one run.

    What a killed run left to move is moved first. A folder without a manifest is not judged.
    """
    for whole in (folder, folder.parent):
        if (whole / _FINISHED / MANIFEST).is_file():
            with _locked(whole):
                _settle(whole)
    if changed := changed_files(folder):
        raise InputError(
            "files here are not those that the run wrote: they were changed, or are of different runs", file=folder,
            value=", ".join(changed), expected=f"what {MANIFEST} says", remedy="plan the job again",
        )  # fmt: skip


@contextmanager
def _locked(folder: Path, *, make: bool = False) -> Generator[bool]:
    """Hold the folder's lock; yield False where the file system has none. Raises InputError where another holds it.

    The lock is the system's own, on the folder itself: it ends with its process, however that ends.
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
            held = _try(handle, folder)
            # Whoever held it before may have removed the folder that it had made.
            there = folder.exists() and os.path.samestat(folder.stat(), os.fstat(handle))
            if there or not make:
                yield held
                return
        finally:
            os.close(handle)


def _try(handle: int, folder: Path) -> bool:
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


def _sweep(folder: Path) -> None:
    """Remove unfinished folders of killed runs; the lock shows that those runs have ended."""
    for path in folder.glob(".unfinished-*"):
        if path.is_dir() and not path.is_symlink() and _UNFINISHED.fullmatch(path.name):
            shutil.rmtree(path, ignore_errors=True)


def _settle(folder: Path) -> None:
    """Put the files of a finished run in their places. Done again after a kill, it goes on where that was.

    All old files go before the first new one comes.
    """
    finished = folder / _FINISHED
    if (finished / MANIFEST).is_file():  # it moves last
        coming = run_files(finished)
        kept = {Path(name) for name in read_manifest(finished)} - set(coming)  # they have moved already
        for relative in reversed(run_files(folder)):
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


def _of_the_folder(error: InputError) -> InputError:
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
