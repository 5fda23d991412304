"""Collision world from a job: the part, its fixture, legs, spindle and tool."""

from __future__ import annotations

from pentapod.base.errors import MachineError
from pentapod.job.build.tool import job_tool
from pentapod.job.schema.job import Job
from pentapod.machine.clearance.collision_world import CollisionWorld
from pentapod.machine.machine import Machine
from pentapod.mesh.io.load import load_mesh
from pentapod.mesh.mesh import Mesh


def job_collision_world(job: Job, machine: Machine, mesh: Mesh) -> CollisionWorld:
    """Return the collision world of a job; mesh: the part's.

    Raises JobError where the tool does not go with the machine.
    """
    held = job_fixture(job)
    name = "fixture" if job.fixture.frame == "part" else "table"
    around = {} if held is None else {name: held}
    try:
        return CollisionWorld.of(machine, job_tool(job), mesh, **around, allowance=job.gouge.si.tolerance)
    except MachineError as error:
        remedy = "a longer tool.length_mm, or a shorter holder"
        raise job.error("tool", "holder_mm", error.what, expected=error.expected, remedy=remedy) from error


def job_fixture(job: Job) -> Mesh | None:
    """Return the mesh of the job's fixture, in the frame that the job says; None where it has none.

    Raises MeshError where it cannot be read.
    """
    if job.fixture_mesh is None:
        return None
    return load_mesh(job.fixture_mesh, job.fixture.unit, scale=job.fixture.scale)
