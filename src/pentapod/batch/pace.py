"""Pace: how many tasks are done, how quickly, and how long the rest will take."""

from __future__ import annotations

import time
from collections.abc import Callable


class Pace:
    """Counts tasks that are run now. total: of them all; clock: seconds."""

    def __init__(self, total: int, clock: Callable[[], float] = time.monotonic) -> None:
        self.total, self._clock, self._start = total, clock, clock()
        self.done = self.new = 0

    def count(self, *, new: bool) -> None:
        """Count a task that is done; new: whether it was run now."""
        self.done += 1
        self.new += new

    @property
    def seconds(self) -> float:
        """Seconds since the start."""
        return self._clock() - self._start

    @property
    def left(self) -> float | None:
        """Seconds that the rest will take at this pace; None where that is not known yet."""
        if not self.new:
            return None
        return (self.total - self.done) * self.seconds / self.new

    def __str__(self) -> str:
        text = f"{self.done} of {self.total}"
        if self.left is None:
            return text
        minutes = self.seconds / 60.0
        rate = f", {self.new / minutes:.3g} a minute" if minutes > 0.0 else ""
        return text + rate + (f", {_spoken(self.left)} left" if self.done < self.total else "")


def _spoken(seconds: float) -> str:
    minutes = round(seconds / 60.0)
    if minutes < 2:
        return f"{seconds:.0f} s"
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60} h {minutes % 60:02d} min"
