"""Ctrl-C and SIGTERM as exceptions, also while modules are still being imported."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from pentapod.base.progress import Progress

RETRY_S = 0.05
"""Seconds after which a signal that came at a bad moment is raised again."""

_NOT_IN = ("<frozen importlib", f"{os.sep}pydantic{os.sep}", f"{os.sep}llvmlite{os.sep}")
"""Where signals wait: in imports; in pydantic, which makes errors of its own of them; in native compilation."""

_unanswered: list[int] = []
"""Signals that were raised and that no search has told of."""


class Terminated(SystemExit):
    """SIGTERM. It ends the command; KeyboardInterrupt only ends a search with the best result so far."""


@contextmanager
def signals_as_exceptions() -> Generator[None]:
    """Raise KeyboardInterrupt on Ctrl-C and Terminated on SIGTERM; once the block has ended, they end the process.

    A signal during an import or a compilation is raised after it, because an interrupted one may raise any other error,
    or none, or leave objects that cannot be destroyed without an error.
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
        _unanswered.clear()


def raising_again(progress: Progress) -> Progress:
    """Return a progress that raises a signal once more that came before and was lost.

    Libraries drop exceptions that reach them in a callback or under a bare `except`. A search that ends with its best
    result so far tells so, in a note that begins with "interrupted"; that signal is answered.
    """

    def shown(stage: str, fraction: float, note: str = "") -> None:
        progress(stage, fraction, note)
        if note.startswith("interrupted"):
            _unanswered.clear()
        elif _unanswered:
            _end_by(_unanswered[-1])

    return shown


def _raise(number: int, frame: FrameType | None) -> None:
    if _is_in(frame, _NOT_IN):
        later = threading.Timer(RETRY_S, signal.raise_signal, (number,))
        later.daemon = True
        later.start()
    else:
        _unanswered.append(number)
        _end_by(number)


def _end_by(number: int) -> NoReturn:
    if number == signal.SIGINT:
        raise KeyboardInterrupt
    raise Terminated(128 + number)


def _is_in(frame: FrameType | None, folders: tuple[str, ...]) -> bool:
    """Whether code in one of these folders is among the callers."""
    while frame is not None:
        if any(folder in frame.f_code.co_filename for folder in folders):
            return True
        frame = frame.f_back
    return False
