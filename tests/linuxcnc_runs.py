"""Folders for LinuxCNC, played by the LinuxCNC that is installed, without a network."""

from __future__ import annotations

import fcntl
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest


def missing() -> str:
    if shutil.which("linuxcnc") is None or shutil.which("halrun") is None:
        return "linuxcnc-uspace is not installed"
    own = ["--net", "--ipc", "--mount", "--pid", "--fork", "--mount-proc"]
    for words in (["unshare", *own], ["unshare", "--map-current-user", "--keep-caps", *own]):
        if subprocess.run([*words, "true"], capture_output=True, check=False).returncode == 0:
            return ""
    return "LinuxCNC is only run without a network, and unshare is not allowed here"


MISSING = missing()
real = pytest.mark.skipif(bool(MISSING), reason=MISSING)
UNBUILT = MISSING or ("" if shutil.which("halcompile") else "linuxcnc-uspace-dev is not installed")
built = pytest.mark.skipif(bool(UNBUILT), reason=UNBUILT)
"""Where the kinematics module is compiled as well."""


def play(folder: Path, code: int = 0, seconds: float = 120.0, words: tuple[str, ...] = ()) -> np.ndarray:
    """Run a folder's play.sh with these words to its exit code, in so many seconds.

    Returns what was recorded, samples' numbers left out; there are no gaps in these numbers.
    """
    log = folder / "test.log"
    # One at a time on a host: LinuxCNC has one lock file for all.
    with (Path(tempfile.gettempdir()) / "pentapod-test-linuxcnc.lock").open("w") as lock, log.open("w") as out:
        fcntl.flock(lock, fcntl.LOCK_EX)
        left = subprocess.run(
            ["sh", "play.sh", *words],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=out,
            timeout=seconds,
            check=False,
        ).returncode
    text = (folder / "played.txt").read_text() if (folder / "played.txt").exists() else ""
    assert left == code, log.read_text()[-2000:]
    assert "overrun" not in text
    table = np.loadtxt(text.splitlines())
    assert (np.diff(table[:, 0]) == 1).all()
    return table[:, 1:]
