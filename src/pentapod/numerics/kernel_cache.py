"""Disk cache of compiled kernels: one folder for each state of their sources.

A kernel holds the machine code of those it calls, but numba looks for changes in the kernel's own file only. So the
folder's name is a digest of all files with kernels, and of how they are compiled: what was compiled for an older
version is never looked at.
The folders are in the user's cache folder, or in the one that NUMBA_CACHE_DIR names; never beside the sources, which
may be read-only.
"""

from __future__ import annotations

import hashlib
import logging
import os
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import IO

_log = logging.getLogger("pentapod")

_NAME = "pentapod-kernels-"
_USED = "lock"


@dataclass(frozen=True)
class CacheOptions:
    """Times of the cache, seconds.

    unused: after which the folder of another version is removed. patience: how long to wait for another process that
    compiles. poll: between two attempts to get the lock.
    """

    unused: float = 30 * 86400.0
    patience: float = 600.0
    poll: float = 0.05


OPTIONS = CacheOptions()


@cache
def kernel_cache(given: str) -> Path | None:
    """Return the folder for these sources, which can be written to; None where there is none.

    given: a folder that the user chose, or "". Folders of versions that were not used for a month are removed.
    """
    sources = [Path(__file__).with_name("kernels.py"), *sorted(Path(__file__).parents[1].rglob("*_kernels.py"))]
    digest = hashlib.sha256(b"\0".join(file.read_bytes() for file in sources)).hexdigest()
    try:
        parent = Path(given) if given else _user_cache()
        folder = parent / f"{_NAME}{digest[:16]}"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        (folder / _USED).touch()  # its time is that of the last use
        with tempfile.TemporaryFile(dir=folder):
            pass
        _sweep(folder)
    except (OSError, RuntimeError) as error:  # RuntimeError: there is no home folder
        _log.warning(
            "the cache of compiled kernels cannot be written (%s): each run compiles them anew; "
            "NUMBA_CACHE_DIR names another folder",
            error,
        )
        return None
    return folder


def _user_cache() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData/Local") / "pentapod"
    if sys.platform == "darwin":
        return Path.home() / "Library/Caches/pentapod"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "pentapod"


def _sweep(folder: Path) -> None:
    """Remove the folders beside this one that have not been used for long."""
    for other in folder.parent.glob(f"{_NAME}*"):
        with suppress(OSError):  # gone already, or not ours
            unused = time.time() - (other / _USED).stat().st_mtime
            if other != folder and unused > OPTIONS.unused and not other.is_symlink():
                shutil.rmtree(other)


class ProcessLock:
    """Lock of a kernel: one process at a time loads or compiles it; others do so with other kernels meanwhile.

    Two that write numba's index of one kernel at once could else file one's machine code under the other's types.
    Kernels that call each other have no cycles, so no two processes wait for each other. A process may enter several
    times, also in several threads; the lock is released when all have left. Where the file system has no locks, and
    after `patience`, the process goes on without.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._count = 0
        self._guard = threading.Lock()
        self._held: IO[bytes] | None = None

    def __enter__(self) -> None:
        with self._guard:
            self._count += 1
            if self._count == 1:
                self._held = _locked(self._path)

    def __exit__(self, *failure: object) -> None:
        with self._guard:
            self._count -= 1
            if self._count == 0 and self._held is not None:
                self._held.close()  # which unlocks it
                self._held = None


def _locked(path: Path) -> IO[bytes] | None:
    """Return the file, open and locked; None where it cannot be locked."""
    try:
        file = path.open("ab")
    except OSError:
        return None
    until = time.monotonic() + OPTIONS.patience
    while time.monotonic() < until:
        try:
            _lock()(file.fileno())
        except (BlockingIOError, PermissionError):  # another process has it
            time.sleep(OPTIONS.poll)
        except OSError:
            break
        else:
            return file
    file.close()
    return None


def _lock() -> Callable[[int], None]:
    """Return a function that locks an open file at once or raises OSError."""
    if sys.platform == "win32":
        import msvcrt  # noqa: PLC0415

        return lambda number: msvcrt.locking(number, msvcrt.LK_NBLCK, 1)
    import fcntl  # noqa: PLC0415

    return lambda number: fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
