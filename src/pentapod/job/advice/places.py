"""Other placements for a job: the constraints to try, and what to write into [placement]."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.units import from_si
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.advice.axes import Changes, taken_out
from pentapod.job.build.placement import job_constraints
from pentapod.job.schema.job import Job
from pentapod.job.schema.placement import PLACEMENT_KEYS
from pentapod.kinematics.component import Component
from pentapod.kinematics.robot import Branch
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.planning.problem.constraints import FREE, PlacementConstraints

_BOUNDS = tuple(dict.fromkeys(key for keys in PLACEMENT_KEYS.values() for key in keys))
_ON_TABLE = ("table_x_mm", "table_y_mm")


@dataclass(frozen=True, eq=False)
class Place:
    """Constraints to try. words: what they are, empty for the job's own. changes: of the job, at what was found."""

    words: str
    constraints: PlacementConstraints
    component: Branch | None
    changes: Callable[[RigidTransform], Changes]


def places(job: Job, machine: Machine, mesh: Mesh) -> list[Place]:
    """Return the placements that the job allows, and wider ones where it bounds them."""
    own, name = job_constraints(job, machine, mesh), job.placement.component
    found = [Place("", own, None if name is None else Component.parse(name), lambda _: {})]
    keys = taken_out(job, "placement", ("component",))
    if job.placement.mode == "table":
        found.append(_higher(job, own, {**keys, **taken_out(job, "placement", _ON_TABLE)}))
    elif own is not FREE or keys:
        free: Changes = {"placement": {"mode": "free", **taken_out(job, "placement", _BOUNDS), **keys}}
        found.append(Place("the planner chooses the placement", FREE, None, lambda _: free))
    return found


def _higher(job: Job, own: PlacementConstraints, keys: dict[str, None]) -> Place:
    """Return a table of any height."""
    upwards = np.zeros((6, 1))
    upwards[2] = 1.0
    wide = np.full(3, np.inf)
    moving = replace(own, motion=np.concatenate([upwards, own.motion], axis=1), low=-wide, high=wide)

    def changes(found: RigidTransform) -> Changes:
        moved = float(from_si(found.translation[2] - own.low[2], "mm"))
        return {"placement": {"table_z_mm": round(job.placement.table_z_mm + moved, 1), **keys}}

    return Place("another height of the table", moving, None, changes)
