"""StageRunner: runs stages and records them. It imports none of them."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Self, TypeVar

from pentapod.base.progress import Progress
from pentapod.base.values import Value
from pentapod.numerics.memory import give_back

T = TypeVar("T")

INTERRUPTED = "interrupted"
"""The word by which a search says that an interruption ended it, and the best so far is kept."""


@dataclass(frozen=True)
class Stage(Value):
    """A stage that ran. value: its result, or a tuple of several; remark: a text about it."""

    name: str
    seconds: float
    value: Any
    remark: str = ""

    def with_value(self, value: Any) -> Self:
        """Return the stage with another result."""
        return replace(self, value=value)


class StageRunner:
    """Runs stages and records their names, wall times and results."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self.stages: list[Stage] = []

    def run(self, name: str, stage: Callable[[], T], remark: Callable[[T], str] = lambda _: "") -> T:
        """Return the result of a stage and record it. remark: returns a text about the result."""
        give_back()
        self.progress(name, 0.0)
        start = time.perf_counter()
        value = stage()
        seconds = time.perf_counter() - start
        self.stages.append(Stage(name, seconds, value, remark(value)))
        self.progress(name, 1.0)
        return value


def ending_when_interrupted(progress: Progress) -> Progress:
    """Return a progress that raises KeyboardInterrupt once a search was interrupted, instead of going on."""

    def shown(stage: str, fraction: float, note: str = "") -> None:
        progress(stage, fraction, note)
        if note.startswith(INTERRUPTED):
            raise KeyboardInterrupt

    return shown
