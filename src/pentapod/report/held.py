"""What holds the part or stands in the machine, for the pictures."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.arrays import Floats, Ints
from pentapod.job.build.collision_world import job_fixture
from pentapod.job.outcome import Outcome
from pentapod.planning.placement.placed_path import PlacedPath


@dataclass(frozen=True, eq=False)
class Held:
    """name; vertices (V, 3), metres, machine frame; faces (F, 3)."""

    name: str
    vertices: Floats
    faces: Ints


def held_mesh(outcome: Outcome, placed: PlacedPath) -> Held | None:
    """Return the fixture of an outcome's job where a placement has it; None where it has none."""
    mesh = job_fixture(outcome.job)
    if mesh is None:
        return None
    if outcome.job.fixture.frame == "machine":
        return Held("table", mesh.vertices, mesh.faces)
    return Held("fixture", placed.placement.transform.apply(mesh.vertices), mesh.faces)
