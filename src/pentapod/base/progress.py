"""Progress: the callback by which long stages report their progress."""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """Called by long stages: the stage's name, the fraction done in [0, 1], and a short note."""

    def __call__(self, stage: str, fraction: float, note: str = "") -> None:
        """Receive a report. Must return quickly and never raise."""
        ...


def silent(stage: str, fraction: float, note: str = "") -> None:
    """Ignore the report: the default of all stages."""
