"""replan: the program of an earlier run for its part where it was found, without searching again."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pentapod.base.errors import InputError
from pentapod.base.progress import Progress, silent
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.clamped.placed_job import placed_job, read_placement
from pentapod.job.outcome import Outcome
from pentapod.job.pipeline.attempt import Writer
from pentapod.job.pipeline.run import run
from pentapod.job.plan_before import PlanBefore
from pentapod.job.schema.job import Job

FOLDER = "replanned"
"""Folder of the new run, within that of the run before."""


def replan(
    folder: str | Path,
    placement: str | Path | RigidTransform,
    out: str | Path | None = None,
    progress: Progress = silent,
    *,
    writers: Mapping[str, Writer] | None = None,
) -> Outcome:
    """Return the outcome of a run's job with the part at a placement, and write it like `run`, with its job file.

    placement: a transform, or a placement file. out: by default FOLDER in the run's folder. Leans and component are
    those of the run, and its time laws as far as the legs' limits allow; where a margin is too small, all is planned
    anew. The toolpath is that of the run: the job must not have changed. The program is judged like any other. Raises
    InputError.
    """
    before = PlanBefore.of(Path(folder))
    if not before.job_file.is_file():
        raise InputError("the job file of this run is gone", file=before.job_file, remedy="plan the job again")
    asked = Job.load(before.job_file)
    if asked.digest != before.made_from.job_digest:
        raise InputError(
            "the job, its mesh or its machine has changed since the run", file=before.job_file,
            remedy="plan it with --placement",
        )  # fmt: skip
    found = placement if isinstance(placement, RigidTransform) else read_placement(placement)
    target = Path(folder) / FOLDER if out is None else Path(out)
    job = placed_job(asked, found, target)
    return run(job, target, progress, before=before, writers=writers, advice=None)
