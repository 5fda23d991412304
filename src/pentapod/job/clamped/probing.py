"""Probing of a run's part: where to touch it, from the folder of the run."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pentapod.base.archives import check_array, read_arrays
from pentapod.base.errors import InputError
from pentapod.base.refusal import Refusal
from pentapod.base.values import Value
from pentapod.cutters.lollipop import Lollipop
from pentapod.geometry.solids import Cone
from pentapod.job.artefacts import ARRAYS
from pentapod.job.build.placement import job_at
from pentapod.job.build.specification import job_fixture
from pentapod.job.build.values import is_compensated, job_machine, job_mesh
from pentapod.job.clamped.registration import cut_surface, planned_placement
from pentapod.job.plan_arrays import GUIDES, JOB_FILE
from pentapod.job.schema.job import Job
from pentapod.kinematics.component import Component
from pentapod.machine.clearance.collision_world import CollisionWorld
from pentapod.mesh.query.distance import MeshDistance
from pentapod.program.commands import counted
from pentapod.registration.probing import OPTIONS, Probing, plan_probing
from pentapod.registration.touches import Touches


@dataclass(frozen=True)
class Probe(Value):
    """A touch probe, metres. length: from the platform's origin to the end of the tip; None for the job's tool length.

    tip_radius: of the ball. stylus, stylus_radius: free length and radius of the stylus. body, body_radius: of the body
    above it.
    """

    length: float | None = None
    tip_radius: float = 2e-3
    stylus: float = 0.04
    stylus_radius: float = 0.001
    body: float = 0.03
    body_radius: float = 0.0125


def probing_of(folder: str | Path, probe: Probe, count: int, misplaced: float = OPTIONS.misplaced) -> Probing | Refusal:
    """Return `count` touches for the part of the run in a folder, clear of part and fixture.

    misplaced: how far the part may be from its place, metres. Raises InputError.
    """
    file = Path(folder) / ARRAYS
    placement = planned_placement(Path(folder))
    names = (JOB_FILE, "placed.component")
    arrays = read_arrays(file, names, InputError, optional=(GUIDES,))
    check_array(arrays[names[1]], names[1], file, InputError, "i", (2,))
    if GUIDES in arrays:
        raise InputError("a machine with guides", file=file, expected="one whose base joints stay where they are")
    job = Job.load(Path(folder) / str(arrays[JOB_FILE]))
    machine, mesh = job_machine(job), job_mesh(job)
    machine = machine if probe.length is None else machine.with_tool(probe.length)
    above = Cone(probe.body, probe.body_radius, probe.body_radius)
    body = Lollipop(probe.tip_radius, probe.stylus_radius, probe.stylus, holder=(above,))
    held = job_fixture(job)
    around = {} if held is None else {"fixture" if job.fixture.frame == "part" else "table": held}
    world = CollisionWorld.of(machine, body, mesh, **around, allowance=0.0)
    pose = job_at(job, placement).placement
    w, s = (int(sign) for sign in np.asarray(arrays[names[1]]).tolist())
    component = Component(w, s)
    empty = np.zeros((0, machine.robot.n_legs))
    head = Touches(
        empty, machine.tool_length, probe.tip_radius, (), component, machine.name, pose.position_mm, pose.rotation_deg
    )
    surface, cut = MeshDistance.of(mesh), cut_surface(job, mesh)
    found = plan_probing(machine, component, surface, placement, cut, world, head, count, misplaced)
    if isinstance(found, Refusal):
        return found
    branch, loaded = np.array(component), is_compensated(job, machine)
    legs, beyond, *ways = (
        counted(machine, *machine.robot.pose(lengths, branch), loaded=loaded)
        for lengths in (found.legs, found.beyond, *found.ways)
    )
    return replace(found, legs=legs, beyond=beyond, ways=tuple(ways))
