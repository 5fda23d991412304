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


def within(progress: Progress, stage: str, begin: float, end: float) -> Progress:
    """Return the progress of a step: its fractions are those of a stage, from `begin` to `end`; its name is the note.

    A step that is done again does not go back.
    """
    outer, furthest = stage, begin

    def shown(stage: str, fraction: float, note: str = "") -> None:
        nonlocal furthest
        furthest = max(furthest, begin + (end - begin) * fraction)
        progress(outer, furthest, note or stage)

    return shown
