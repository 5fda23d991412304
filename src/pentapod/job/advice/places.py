"""Other placements for a job: the constraints to try, and what to write into [placement]."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.units import from_si, to_si
from pentapod.geometry.directions import angle_between, normalised
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.advice.axes import Changes, taken_out
from pentapod.job.advice.options import AdviceOptions
from pentapod.job.advice.sketch import Sketch
from pentapod.job.build.placement import job_constraints
from pentapod.job.schema.job import Job
from pentapod.job.schema.placement import PLACEMENT_KEYS
from pentapod.kinematics.component import Component
from pentapod.kinematics.robot import Branch
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.planning.placement.common_axes import cap_centre
from pentapod.planning.problem.constraints import FREE, PlacementConstraints

INTO_TABLE = -0.5
"""Cosine of a region's direction and the part's upward one, below which the tool would come through the table."""

_BOUNDS = tuple(dict.fromkeys(key for keys in PLACEMENT_KEYS.values() for key in keys if key != "table_z_mm"))


@dataclass(frozen=True, eq=False)
class Place:
    """Constraints to try. words: what they are, empty for the job's own. changes: of the job, at what was found."""

    words: str
    constraints: PlacementConstraints
    component: Branch | None
    changes: Callable[[RigidTransform], Changes]


def places(job: Job, machine: Machine, mesh: Mesh, sketch: Sketch, options: AdviceOptions) -> list[Place]:
    """Return the placements that the job allows, and wider ones where it bounds them, the nearest to its own first.

    On a table, or fixed: turned about the vertical, at another height, lying on another face. Then any.
    """
    own, name = job_constraints(job, machine, mesh), job.placement.component
    found = [Place("", own, None if name is None else Component.parse(name), lambda _: {})]
    keys = taken_out(job, "placement", ("component",))
    if job.placement.mode in ("table", "fixed"):
        table = _Table.of(job, machine, mesh, own)
        if job.placement.mode == "fixed":
            found.append(table.place("turned about the vertical", table.up, moving=False))
        if float(normalised(job.part.si.region_direction) @ table.up) > INTO_TABLE:
            found.append(table.place("another height of the table", table.up, moving=True))
        for face in _faces(job, sketch):
            if float(angle_between(face, table.up)) > to_si(options.other_face_deg, "deg"):
                found.append(table.place("lying on another face", face, moving=True))
    if own is not FREE or keys:
        bounds = taken_out(job, "placement", ("table_z_mm", *_BOUNDS))
        free: Changes = {"placement": {**bounds, "mode": "free", **keys}}
        found.append(Place("the planner chooses the placement", FREE, None, lambda _: free))
    return found


def _faces(job: Job, sketch: Sketch) -> list[Floats]:
    """Return directions to turn upwards: that of the region, and the axis of the part next to its middle normal."""
    view, middle = normalised(job.part.si.region_direction), cap_centre(sketch.normals)
    nearest, largest = np.zeros(3), int(np.abs(middle).argmax())
    nearest[largest] = np.sign(middle[largest])
    return [view] if np.allclose(view, nearest) else [view, nearest]


@dataclass(frozen=True, eq=False)
class _Table:
    """The table on which a part stands. height: z of its surface; up: of the part; side: z of the way to the base."""

    job: Job
    mesh: Mesh
    height: float
    up: Floats
    side: float

    @classmethod
    def of(cls, job: Job, machine: Machine, mesh: Mesh, own: PlacementConstraints) -> _Table:
        """Return the table of a job, or one under a part that is fixed."""
        side = -1.0 if machine.work.centre[2] > 0.0 else 1.0
        if job.placement.mode == "table":
            return cls(job, mesh, job.placement.si.table_z, normalised(job.placement.up), side)
        pose = own.poses[0]
        up = np.round(pose.inverse().rotate(np.array([0.0, 0.0, side])), 4) + 0.0
        lowest = pose.apply(mesh.vertices)[:, 2]
        return cls(job, mesh, float(lowest.min() if side > 0.0 else lowest.max()), normalised(up), side)

    def place(self, words: str, up: Floats, *, moving: bool) -> Place:
        """Return the part with a direction upwards, turned and shifted. moving: whether the table has any height."""
        lowest = float((self.mesh.vertices @ up).min())
        height = self.height - self.side * lowest
        constraints = PlacementConstraints.table(height, up=up, normal=(0.0, 0.0, self.side))
        if moving:
            upwards = np.zeros((6, 1))
            upwards[2] = 1.0
            wide = np.full(3, np.inf)
            motion = np.concatenate([upwards, constraints.motion], axis=1)
            constraints = replace(constraints, motion=motion, low=-wide, high=wide)
        others = taken_out(self.job, "placement", ("component", *_BOUNDS))
        same = "up" not in others and np.allclose(up, [0.0, 0.0, 1.0])
        keys = others if same else {**others, "up": [round(float(v), 4) + 0.0 for v in up]}

        def changes(found: RigidTransform) -> Changes:
            z = float(found.translation[2]) + self.side * lowest
            return {"placement": {**keys, "mode": "table", "table_z_mm": round(float(from_si(z, "mm")), 1)}}

        return Place(words, constraints, None, changes)
