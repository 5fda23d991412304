"""Limits from a job: those of installed packages that [limits] names."""

from __future__ import annotations

from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine
from pentapod.planning.limits.limit import LimitKind
from pentapod.planning.limits.margins import LIMITS
from pentapod.planning.limits.tip_stiffness import STIFFNESS
from pentapod.timing.limits.limit import NO_RESERVE, Limit
from pentapod.timing.limits.limits import PLUGGED


def pose_limits(job: Job) -> tuple[LimitKind, ...]:
    """Return the limits on poses besides pentapod's own. Raises InputError: one cannot be loaded."""
    return tuple(LIMITS.find(name) for name in job.limits.use if name in LIMITS.added)


def placement_limits(job: Job) -> tuple[LimitKind, ...]:
    """Return the limits on poses besides pentapod's own, and what else the placement prefers. Raises InputError."""
    return (*pose_limits(job), *(() if job.placement.weight_stiffness is None else (STIFFNESS,)))


def timing_limits(job: Job, machine: Machine) -> tuple[Limit, ...]:
    """Return the limits on the time law beside the machine's own. Raises InputError: one cannot be loaded."""
    found = (PLUGGED.find(name).of(machine, NO_RESERVE) for name in job.limits.use if name in PLUGGED.added)
    return tuple(limit for limit in found if limit is not None)
