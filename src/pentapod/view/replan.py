"""Planning anew with the part where it was dragged to."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pentapod.base.progress import Progress, silent
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.artefacts import REPORT
from pentapod.job.build.placement import job_at, placement_toml
from pentapod.job.outcome import Outcome
from pentapod.job.pipeline import run as run_job
from pentapod.report import write_report
from pentapod.view.opened import Opened, run_of

FOLDER = "replanned"
"""Where the files go, within the folder of the run that is looked at."""


@dataclass(frozen=True, eq=False)
class Replanned:
    """What planning anew came to. run: to be looked at, None where it was refused.

    table: for the job file; of one of several set-ups for a copy of it, for the others stand elsewhere.
    """

    outcome: Outcome
    run: Opened | None
    folder: Path
    table: str


def replanned(run: Opened, placement: RigidTransform, progress: Progress = silent) -> Replanned:
    """Plan the run's job, or its set-up's piece of it, with the part fixed at a placement, all artefacts included.

    The program's job is the run's with `table` as its [placement]: with that in the job file, `verify` knows it.
    """
    job = job_at(run.job, placement)
    folder = run.folder if run.folder.name == FOLDER else run.folder / FOLDER
    outcome = run_job(job, folder, progress, piece=run.piece, writers={REPORT: write_report})
    return Replanned(outcome, run_of(outcome, folder), folder, placement_toml(job.placement))
