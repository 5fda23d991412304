"""Ctrl-C while a placement is searched for: the best so far is kept and told, where there is one that fits."""

import signal

import pytest

from pentapod.planning import PlacedPath, plan
from pentapod.planning.plan import NEEDED_MARGIN


def interrupting(after: int):
    """A progress that sends this process the signal of Ctrl-C once `after` starts were improved."""
    notes: list[str] = []

    def progress(stage: str, fraction: float, note: str = "") -> None:
        notes.append(note)
        improved = "best margin so far" in note and sum("best margin so far" in told for told in notes)
        if improved == after if after else note == "sampling":
            signal.raise_signal(signal.SIGINT)

    return progress, notes


def test_the_best_so_far_is_kept_and_told(desk, cap):
    progress, notes = interrupting(after=1)
    answer = plan(cap, desk, tilt=0.2, progress=progress)
    assert isinstance(answer, PlacedPath)
    assert answer.smallest_margin >= NEEDED_MARGIN - 1e-3
    assert "interrupted after" in answer.placement.chosen_by
    assert any("interrupted: the best so far is kept" in note for note in notes)


def test_with_nothing_that_fits_it_is_an_interruption(desk, cap, wide):
    for toolpath, after in ((cap, 0), (wide, 1)):
        with pytest.raises(KeyboardInterrupt):
            plan(toolpath, desk, tilt=0.2, progress=interrupting(after)[0])


def test_progress_names_component_and_best_margin(desk, cap):
    notes: list[tuple[str, float, str]] = []
    plan(cap, desk, tilt=0.2, progress=lambda *news: notes.append((*news, "")[:3]))
    told = [note for stage, _, note in notes if stage == "placement" and "best margin so far" in note]
    margins = [float(note.rsplit(" ", 1)[1]) for note in told]
    assert len(told) >= 4
    assert margins == sorted(margins)
    assert all(note.startswith("component ") for note in told)
