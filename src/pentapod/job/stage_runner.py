"""StageRunner: runs stages and records them."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

from pentapod.base.progress import Progress
from pentapod.job.outcome import Stage

T = TypeVar("T")


class StageRunner:
    """Runs stages and records their names, wall times and results."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self.stages: list[Stage] = []

    def run(self, name: str, stage: Callable[[], T], remark: Callable[[T], str] = lambda _: "") -> T:
        """Return the result of a stage and record it. remark: returns a text about the result."""
        self.progress(name, 0.0)
        start = time.perf_counter()
        value = stage()
        seconds = time.perf_counter() - start
        self.stages.append(Stage(name, seconds, value, remark(value)))
        self.progress(name, 1.0)
        return value
