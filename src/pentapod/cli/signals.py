"""Ctrl-C and SIGTERM: as exceptions, also in the first second, when modules are still being loaded."""

from __future__ import annotations

import signal
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType

_AGAIN_S = 0.05


class Terminated(SystemExit):
    """SIGTERM. Unlike KeyboardInterrupt it does not end a search with the best found so far: it ends the command."""


@contextmanager
def signals_told() -> Generator[None]:
    """Raise KeyboardInterrupt on Ctrl-C and Terminated on SIGTERM; once the block has ended, they end the process.

    A signal that comes while a module is loaded is taken when that is done: a module that is cut off raises whatever it
    likes, or swallows the interruption. Signals that the parent told this process to ignore stay ignored.
    """
    heeded = [number for number in (signal.SIGINT, signal.SIGTERM) if signal.getsignal(number) != signal.SIG_IGN]
    for number in heeded:
        signal.signal(number, _take)
    try:
        yield
    finally:
        for number in heeded:
            signal.signal(number, signal.SIG_DFL)


def _take(number: int, frame: FrameType | None) -> None:
    if _is_loading(frame):
        later = threading.Timer(_AGAIN_S, signal.raise_signal, (number,))
        later.daemon = True
        later.start()
    elif number == signal.SIGINT:
        raise KeyboardInterrupt
    else:
        raise Terminated(128 + number)


def _is_loading(frame: FrameType | None) -> bool:
    """Whether a module is being imported: then the import system is among the callers."""
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False
