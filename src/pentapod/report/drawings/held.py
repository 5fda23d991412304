"""The fixture or table of a job, for the drawings."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.build.specification import job_fixture
from pentapod.job.schema.job import Job


@dataclass(frozen=True, eq=False)
class Held:
    """Mesh of a fixture or table: vertices (V, 3), metres, machine frame; faces (F, 3)."""

    name: str
    vertices: Floats
    faces: Ints


def held_at(job: Job, placement: RigidTransform) -> Held | None:
    """Return the fixture of a job whose part is at a placement; None where the job has none."""
    mesh = job_fixture(job)
    if mesh is None:
        return None
    if job.fixture.frame == "machine":
        return Held("table", mesh.vertices, mesh.faces)
    return Held("fixture", placement.apply(mesh.vertices), mesh.faces)
