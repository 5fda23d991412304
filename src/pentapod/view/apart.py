"""A call in a process of its own, which can be ended at any moment: its reports of progress, then its result."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from typing import Any, BinaryIO, cast

from pentapod.base.errors import PentapodError
from pentapod.base.progress import Progress

_CODE = (
    "import pickle, sys; sys.path[:] = pickle.load(sys.stdin.buffer); from pentapod.view.apart import answer; answer()"
)


class EndedError(Exception):
    """The process has ended without a result."""


class Apart:
    """A process that makes one call. `end` may come from another thread, before or during `result`."""

    def __init__(self) -> None:
        """Start the process; it waits for the call."""
        self._process = subprocess.Popen([sys.executable, "-c", _CODE], stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def result(self, work: Callable[..., Any], *given: Any, progress: Progress) -> Any:
        """Return work(*given, progress); function, values and result are pickled.

        Raises EndedError, where the process was ended or died, and PentapodError with the text of what `work` raised.
        """
        to, back = cast("BinaryIO", self._process.stdin), cast("BinaryIO", self._process.stdout)
        try:
            with to, back:
                for value in (sys.path, (work, given)):
                    pickle.dump(value, to)
                to.flush()
                while True:
                    kind, said = pickle.load(back)
                    if kind == "progress":
                        progress(*said)
                    elif kind == "error":
                        raise PentapodError(said)
                    else:
                        return said
        except (EOFError, BrokenPipeError, pickle.UnpicklingError) as error:
            raise EndedError from error
        finally:
            self.end()

    def end(self) -> None:
        """End the process at once, if it runs yet."""
        self._process.kill()
        self._process.wait()


def answer() -> None:
    """Make the call that stdin has, and write reports and result to stdout: the process's own part of `Apart`."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C in a terminal reaches it, too; who started it ends it
    back = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what libraries print does not go between the answers

    def said(kind: str, value: Any) -> None:
        pickle.dump((kind, value), back)
        back.flush()

    work, given = pickle.load(sys.stdin.buffer)
    try:
        said("result", work(*given, lambda *report: said("progress", report)))
    except PentapodError as error:
        said("error", str(error))
