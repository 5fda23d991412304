"""The fixture or table of an outcome, for the figures."""

from __future__ import annotations

from pentapod.job.outcome import Outcome
from pentapod.planning.placement.placed_path import PlacedPath
from pentapod.report.drawings.held import Held, held_at


def held_mesh(outcome: Outcome, placed: PlacedPath) -> Held | None:
    """Return the fixture of an outcome's job at a placement; None where the job has none."""
    return held_at(outcome.job, placed.placement.transform)
