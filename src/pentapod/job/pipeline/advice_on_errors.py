"""Advice for jobs that are an error: the region holds nothing to machine, or the part is too large for the machine."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from pentapod.base.errors import InputError
from pentapod.base.progress import Progress, silent
from pentapod.job.advice.options import OPTIONS, AdviceOptions
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.job.build.words import NO_CUT
from pentapod.job.pipeline.run import tried
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine

if TYPE_CHECKING:
    from pentapod.job.advice.search import Advised

_KEYS = frozenset(("region", NO_CUT, "part.unit", "part.scale", "curve", "toolpath.shallowest_deg"))


def can_help(error: InputError) -> bool:
    """Return whether an error of `run` is about a task that other values of the job may make possible."""
    return error.key in _KEYS


def advise(
    job: Job, *, machine: Machine | None = None, options: AdviceOptions = OPTIONS, progress: Progress = silent
) -> Advised:
    """Return changes with which a job that cannot be done is planned, and its verdict passes.

    For jobs for which `run` raises an error of those that `can_help` names; refusals hold their advice. Raises
    InputError for a bad job, mesh or machine.
    """
    from pentapod.job.advice.search import advised  # noqa: PLC0415  slow, and most jobs need none

    used, mesh = job_machine(job, machine), job_mesh(job, progress)
    return advised(job, used, mesh, None, partial(tried, machine=machine), options, progress)
