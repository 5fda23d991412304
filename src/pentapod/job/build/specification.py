"""Specification from a job: everything that its program is verified against."""

from __future__ import annotations

from collections.abc import Callable

from pentapod.job.build.collision_world import job_collision_world
from pentapod.job.build.cutting import job_cutting
from pentapod.job.build.placement import job_constraints
from pentapod.job.build.sources import job_sources
from pentapod.job.schema.job import Job
from pentapod.kinematics.component import Component
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify import Specification


def job_specification(job: Job, machine: Machine, mesh: Mesh, make_toolpath: Callable[[], Toolpath]) -> Specification:
    """Return the requirements of a job on its program; machine and mesh: those of the job.

    make_toolpath: called last, so that errors of the job's tables are told before the long work.
    Raises JobError where tables of the job do not go with the machine or the mesh.
    """
    collision_world, constraints = job_collision_world(job, machine, mesh), job_constraints(job, machine, mesh)
    cutting, component = job_cutting(job, collision_world), job.placement.component
    return Specification(
        machine,
        make_toolpath(),
        tilt=job.axis.si.tilt,
        path_tolerance=job.tolerance.si.path,
        axis_tolerance=job.tolerance.si.axis,
        job_digest=job.digest,
        collision_world=collision_world,
        cutting=cutting,
        constraints=constraints,
        component=None if component is None else Component.parse(component),
        lowest_share=job.feed.lowest_share,
        stop_angle=job.feed.si.stop_angle,
        setups=job.placement.setups,
        waived=job.verify.waive,
        sources=job_sources(job),
    )
