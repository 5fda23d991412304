"""Silence: a word after some seconds without one, so that a long computation is not taken for a stopped one."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from types import TracebackType

LOOKS = 4
"""How often it is looked, in the time after which something is said."""


class Silence:
    """Calls `say` after `after_s` seconds without `heard`, and again after as many; from a thread, within `with`.

    clock: seconds.
    """

    def __init__(self, say: Callable[[], None], after_s: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._say, self._after, self._clock, self._last = say, after_s, clock, clock()
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def heard(self) -> None:
        """Begin to count anew: something was said."""
        self._last = self._clock()

    def look(self) -> None:
        """Say something if it is time."""
        if self._clock() - self._last >= self._after:
            self.heard()
            self._say()

    def __enter__(self) -> Silence:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ends.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._ends.wait(self._after / LOOKS):
            self.look()
