"""The fixture or table of a job, for the drawings."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.arrays import Floats, Ints
from pentapod.job.build.specification import job_fixture
from pentapod.job.outcome import Outcome
from pentapod.planning.placement.placed_path import PlacedPath


@dataclass(frozen=True, eq=False)
class Held:
    """Mesh of a fixture or table: vertices (V, 3), metres, machine frame; faces (F, 3)."""

    name: str
    vertices: Floats
    faces: Ints


def held_mesh(outcome: Outcome, placed: PlacedPath) -> Held | None:
    """Return the fixture of an outcome's job at a placement; None where the job has none."""
    mesh = job_fixture(outcome.job)
    if mesh is None:
        return None
    if outcome.job.fixture.frame == "machine":
        return Held("table", mesh.vertices, mesh.faces)
    return Held("fixture", placed.placement.transform.apply(mesh.vertices), mesh.faces)
