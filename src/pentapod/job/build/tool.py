"""Tool from a job."""

from __future__ import annotations

from typing import Any, cast

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import fields_from, file_key
from pentapod.cutters.mounted import Mounted
from pentapod.cutters.registry import CUTTERS
from pentapod.cutters.tool import Tool
from pentapod.geometry.solids import Cone
from pentapod.job.build.values import job_machine
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine


def job_tool(job: Job, machine: Machine | None = None) -> Tool:
    """Return the job's tool, by default with a stem up to the spindle: see `Mounted.with_stem`.

    machine: the one to use instead of the machine that the job names. Raises JobError where its sizes make no tool.
    """
    cutter = CUTTERS[job.tool.type]
    mounted = {"shank": _cones(job.tool.si.shank), "holder": _cones(job.tool.si.holder)}
    try:
        tool = cutter(**fields_from(cutter, job.tool), **mounted)
    except ToolpathError as error:
        key = file_key(cutter, error.key or "") or "type"
        raise job.error("tool", key, error.what, expected=error.expected) from error
    if isinstance(tool, Mounted):
        tool = cast(Any, tool).with_stem(job_machine(job, machine).bodies.shaft_end)
    return tool


def _cones(pieces: Floats | None) -> tuple[Cone, ...]:
    """Return the pieces of a shank or holder from rows of height, lower and upper diameter."""
    return () if pieces is None else tuple(Cone(height, 0.5 * low, 0.5 * high) for height, low, high in pieces.tolist())
