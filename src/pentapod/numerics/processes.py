"""Two calls at a time, the second in a fork of this process: for work that holds the interpreter."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable
from multiprocessing import get_context
from typing import TypeVar, cast

from pentapod.numerics.threads import cores

_One = TypeVar("_One")
_Other = TypeVar("_Other")


def both(one: Callable[[], _One], other: Callable[[], _Other]) -> tuple[_One, _Other]:
    """Return the results of two calls, of which neither changes what the other reads; that of `other` is pickled.

    With one core, with other threads in this process, which a fork could leave waiting for ever, and where there are no
    forks, `other` is called after `one`, as it is where the fork fails. The results are the same.
    """
    if cores() == 1 or not _may_fork():
        return one(), other()
    context = get_context("fork")
    receiving, sending = context.Pipe(duplex=False)

    def send() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that waits
        receiving.close()
        try:
            found = (other(),)
        except Exception:  # it is raised again where this is called without a fork
            found = None
        sending.send(found)

    fork = context.Process(target=send, daemon=True)
    fork.start()
    sending.close()
    try:
        first = one()
        try:
            second = cast("tuple[_Other] | None", receiving.recv())
        except EOFError:  # the fork has died
            second = None
    finally:
        receiving.close()
        fork.kill()
        fork.join()
    return first, other() if second is None else second[0]


def _may_fork() -> bool:
    """Return whether a fork of this process finds all locks open: on Linux, from the only thread."""
    alone = threading.active_count() == 1 and threading.current_thread() is threading.main_thread()
    return sys.platform == "linux" and alone
