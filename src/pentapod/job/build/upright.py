"""Upright tool: another way to do a job whose tool may lean, for parts on which no smooth lean keeps the tool clear.

The tool stands along the view everywhere, and passes end where the part leans over them. What such a tool does not
reach is left: the verdict tells how much of it a leaning tool might reach.
"""

from __future__ import annotations

from dataclasses import replace

from pentapod.job.build.region import covers_region, rolls
from pentapod.job.schema.job import Job


def may_stand(job: Job) -> bool:
    """Return whether an upright tool may do a job: a ball covers a region, and its axis is left to the planner."""
    return job.axis.mode == "auto" and job.asked is None and covers_region(job) and rolls(job)


def upright(job: Job) -> Job:
    """Return the job with the tool along its view, and no passes under what leans over. Its digest stays."""
    axis = dict.fromkeys(job.axis.model_fields_set)
    axis |= {"mode": "fixed", "direction": job.part.region_direction, "tilt_deg": 0.0}
    made = job.with_(axis=axis, toolpath={"under_mm": 0.0})
    return replace(made, asked=job, from_file=job.from_file)
