"""Ctrl-C and SIGTERM as exceptions, also while modules are still being imported."""

from __future__ import annotations

import signal
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType

RETRY_S = 0.05
"""Seconds after which a signal that came during an import is raised again."""


class Terminated(SystemExit):
    """SIGTERM. It ends the command; KeyboardInterrupt only ends a search with the best result so far."""


@contextmanager
def signals_as_exceptions() -> Generator[None]:
    """Raise KeyboardInterrupt on Ctrl-C and Terminated on SIGTERM; once the block has ended, they end the process.

    A signal during an import is raised after it, because an interrupted import may raise any other error, or none.
    Signals that the parent process set to be ignored stay ignored.
    """
    handled = [number for number in (signal.SIGINT, signal.SIGTERM) if signal.getsignal(number) != signal.SIG_IGN]
    for number in handled:
        signal.signal(number, _raise)
    try:
        yield
    finally:
        for number in handled:
            signal.signal(number, signal.SIG_DFL)


def _raise(number: int, frame: FrameType | None) -> None:
    if _is_loading(frame):
        later = threading.Timer(RETRY_S, signal.raise_signal, (number,))
        later.daemon = True
        later.start()
    elif number == signal.SIGINT:
        raise KeyboardInterrupt
    else:
        raise Terminated(128 + number)


def _is_loading(frame: FrameType | None) -> bool:
    """Whether the import system is among the callers."""
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False
