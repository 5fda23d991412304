"""Planning again with the part at the placement to which it was dragged."""

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
from pentapod.view.opened_run import OpenedRun, run_of

FOLDER = "replanned"
"""Folder of the files, within the folder of the run."""


@dataclass(frozen=True, eq=False)
class Replanned:
    """Result of planning again. run: None where it was refused.

    table: [placement] for the job file; for one of several set-ups it belongs into a copy of the job file.
    """

    outcome: Outcome
    run: OpenedRun | None
    folder: Path
    table: str


def replanned(run: OpenedRun, placement: RigidTransform, progress: Progress = silent) -> Replanned:
    """Plan the run's job, or its set-up's piece of it, with the part fixed at a placement, all artefacts included.

    With `table` as [placement] in the job file, `verify` accepts the program.
    """
    job = job_at(run.job, placement)
    folder = run.folder if run.folder.name == FOLDER else run.folder / FOLDER
    outcome = run_job(job, folder, progress, piece=run.piece, writers={REPORT: write_report}, advice=None)
    return Replanned(outcome, run_of(outcome, folder), folder, placement_toml(job.placement))
