"""Gouge limits from a job: the bodies that cut, and the largest depth."""

from __future__ import annotations

from pentapod.job.build.coverage import job_coverage
from pentapod.job.build.strategy import job_sink
from pentapod.job.build.tool import job_tool
from pentapod.job.schema.job import Job
from pentapod.machine.clearance.collision_world import CollisionWorld
from pentapod.verify import Cutting


def job_cutting(job: Job, collision_world: CollisionWorld) -> Cutting | None:
    """Return what a job cuts; collision_world: with its part. None where there is none.

    What counts as no gouge, and what the job engraves, is no gouge here either. Raises JobError where the tool's
    lengths make no tool.
    """
    depth = job.gouge.si.tolerance + job_sink(job)
    for obstacle in collision_world.obstacles:
        if obstacle.name == "part":
            mesh = obstacle.surface.mesh
            return Cutting(obstacle.surface, job_tool(job).solids, depth, job_coverage(job, mesh))
    return None
