"""StageRunner: runs the stages of a job and records their results and times."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

from pentapod.base.progress import Progress
from pentapod.job.outcome import Stage

Value = TypeVar("Value")


class StageRunner:
    """Runs stages and records their names, wall times and results."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self.stages: list[Stage] = []

    def time(self, name: str, stage: Callable[[], Value], says: Callable[[Value], str] | None = None) -> Value:
        """Return the result of a stage; it is recorded with its wall time and, if `says` is given, a text about it."""
        self.progress(name, 0.0)
        start = time.perf_counter()
        value = stage()
        seconds = time.perf_counter() - start
        self.stages.append(Stage(name, seconds, value, says(value) if says else ""))
        self.progress(name, 1.0)
        return value
