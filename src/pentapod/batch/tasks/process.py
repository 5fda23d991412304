"""Child: the process in which the tasks of a worker run; its memory is watched."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from queue import Empty, SimpleQueue
from typing import Any

from pentapod.batch.tasks.child import OUT_OF_MEMORY
from pentapod.numerics.threads import CORES

POLL_S = 0.2
"""Seconds between two looks at the process of a task: its memory, and whether the worker shall end."""

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", CORES)


class Child:
    """The process of tasks of this worker."""

    def __init__(self) -> None:
        environment = {**os.environ, **dict.fromkeys(_THREADS, "1"), "PYTHONPATH": os.pathsep.join(sys.path)}
        self._process = subprocess.Popen(
            [sys.executable, "-m", "pentapod.batch.tasks.child"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, env=environment, start_new_session=True,
        )  # fmt: skip
        self._lines: SimpleQueue[bytes] = SimpleQueue()
        threading.Thread(target=self._read, daemon=True).start()

    @property
    def is_alive(self) -> bool:
        """Whether it can take an order."""
        return self._process.poll() is None

    def ask(self, order: Mapping[str, Any], memory: float, ending: Callable[[], bool]) -> dict[str, Any]:
        """Return the answer to an order; "crashed" where it takes more memory, "died" where the process ends.

        ending: returns whether the worker shall end, which ends the process.
        """
        import psutil  # noqa: PLC0415  comes with Dask

        try:
            self._process.stdin.write(json.dumps(order).encode() + b"\n")  # pyright: ignore[reportOptionalMemberAccess]
            self._process.stdin.flush()  # pyright: ignore[reportOptionalMemberAccess]
            watched = psutil.Process(self._process.pid)
            while True:
                try:
                    line = self._lines.get(timeout=POLL_S)
                    break
                except Empty:
                    if watched.memory_info().rss > memory:
                        self.end()
                        return {"crashed": f"{OUT_OF_MEMORY}: more than {1e-6 * memory:.0f} MB"}
                    if ending():
                        self.end()
        except (OSError, psutil.Error):
            line = b""
        if line:
            return json.loads(line)
        self.end()
        return {"died": _ended(self._process.wait())}

    def end(self) -> None:
        """Kill the process."""
        self._process.kill()

    def _read(self) -> None:
        for line in self._process.stdout or ():
            self._lines.put(line)
        self._lines.put(b"")


def _ended(code: int) -> str:
    if code < 0:
        try:
            return f"killed by {signal.Signals(-code).name}"
        except ValueError:
            return f"killed by signal {-code}"
    return f"ended with exit code {code}"
