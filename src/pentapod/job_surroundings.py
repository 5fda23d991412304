"""From a job to what legs, spindle and tool must not touch: the part, its fixture, and the legs the tool."""

from __future__ import annotations

from pentapod.job import Job
from pentapod.job_tool import job_tool
from pentapod.machine.machine import Machine
from pentapod.machine.surroundings import Obstacle, Surroundings, mounted
from pentapod.toolpath.load import load_mesh
from pentapod.toolpath.mesh import Mesh
from pentapod.toolpath.mesh_distance import MeshDistance

_MM = 1e-3


def job_surroundings(job: Job, machine: Machine, mesh: Mesh) -> Surroundings:
    """Return the surroundings of a job; mesh: the part's.

    Raises JobError where the tool does not go with the machine.
    """
    tool = mounted(job_tool(job).solids, machine)
    room = machine.tool_length - float(machine.pentapod.offsets.max())
    if tool and max(solid.high for solid in tool) > room:
        raise job.error(
            "tool",
            "holder_mm",
            "the tool stands above the lowest platform joint",
            expected=f"at most {room / _MM:.4g} mm from the tip to the holder's end",
            remedy="a longer tool.length_mm, or a shorter holder",
        )
    part = Obstacle("part", MeshDistance.of(mesh), clamped=True, allowance=job.gouge.tolerance_mm * _MM)
    held = job_fixture(job)
    if held is None:
        return Surroundings((part,), tool)
    clamped = job.fixture.frame == "part"
    return Surroundings(
        (part, Obstacle("fixture" if clamped else "table", MeshDistance.of(held), clamped=clamped)), tool
    )


def job_fixture(job: Job) -> Mesh | None:
    """Return the mesh of the job's fixture, in the frame that the job says; None where it has none.

    Raises MeshError where it cannot be read.
    """
    if job.fixture_mesh is None:
        return None
    return load_mesh(job.fixture_mesh, job.fixture.unit, scale=job.fixture.scale)
