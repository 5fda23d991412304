"""StageRunner: runs the stages of a job, and keeps what they gave."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

from pentapod.base.progress import Progress
from pentapod.job.outcome import Stage

Value = TypeVar("Value")


class StageRunner:
    """Runs stages and keeps their names, times and values."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self.stages: list[Stage] = []

    def time(self, name: str, stage: Callable[[], Value], says: Callable[[Value], str] | None = None) -> Value:
        """Return what a stage gives; it is kept with its wall time, and with what `says` says of it."""
        self.progress(name, 0.0)
        start = time.perf_counter()
        value = stage()
        seconds = time.perf_counter() - start
        self.stages.append(Stage(name, seconds, value, says(value) if says else ""))
        self.progress(name, 1.0)
        return value
