"""Placement constraints and weights from a job's table [placement], and the table of a chosen placement."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ArrayError, InputError
from pentapod.base.keys import VECTOR
from pentapod.base.tables import TomlTable
from pentapod.base.units import from_si, to_si
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.schema.job import Job
from pentapod.job.schema.placement import PLACEMENT_KEYS, PlacementTable
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.planning.problem.constraints import FREE, PlacementConstraints
from pentapod.planning.problem.weights import Weights

_EVERYWHERE = (-np.inf, np.inf)
_BOUNDING_KEYS = frozenset(("mode", "setups", *(key for keys in PLACEMENT_KEYS.values() for key in keys)))
"""Keys that bound the placement; the other keys are objectives."""


def job_constraints(job: Job, machine: Machine, mesh: Mesh) -> PlacementConstraints:
    """Return the placements that the job allows. Raises JobError where its matrix is not rigid."""
    table = job.placement
    if table.mode == "fixed":
        return PlacementConstraints.fixture([fixed_placement(table, partial(job.error, "placement"))])
    if table.mode == "fixture":
        return PlacementConstraints.fixture([pose_of(pose[:3], pose[3:]) for pose in table.poses_mm_deg or ()])
    if table.mode == "table":
        return _on_table(job, machine, mesh)
    if table.box_mm is None and table.largest_turn_deg is None:
        return FREE
    corners = np.array([[-np.inf] * 3, [np.inf] * 3]) if table.box_mm is None else table.si.box
    turn = np.pi if table.largest_turn_deg is None else table.si.largest_turn
    reference = pose_of((0.0, 0.0, 0.0), table.rotation_deg or (0.0, 0.0, 0.0))
    low, high = corners.min(axis=0), corners.max(axis=0)
    return PlacementConstraints.free(low=low, high=high, reference=reference, largest_turn=turn)


def job_weights(job: Job) -> Weights:
    """Return the weights of the margins in the job's objective."""
    table = job.placement
    return Weights(
        table.weight_strokes,
        table.weight_singularities,
        table.weight_joints,
        table.weight_bodies,
        table.weight_stiffness or 1.0,
    )


def job_at(job: Job, placement: RigidTransform) -> Job:
    """Return the job with its part fixed at a placement, rounded as in `placement_toml`."""
    table = job.placement
    kept = {name: getattr(table, name) for name in table.model_fields_set - _BOUNDING_KEYS}
    position = _rounded(from_si(placement.translation, "mm"), 6)
    angles = _rounded(np.array(rotation_angles_deg(placement.rotation)), 8)
    fixed = PlacementTable(mode="fixed", position_mm=position, rotation_deg=angles, **kept)
    return dataclasses.replace(job, tables=job.tables.model_copy(update={"placement": fixed}))


def _rounded(values: Floats, digits: int) -> VECTOR:
    x, y, z = (round(float(value), digits) + 0.0 for value in values)  # no −0
    return x, y, z


def placement_toml(table: TomlTable) -> str:
    """Return a table [placement] in TOML, without keys that have their defaults."""
    content = table.model_dump(mode="json", exclude_defaults=True)
    lines = [f"{key} = {json.dumps(value)}" for key, value in content.items()]
    return "\n".join(["[placement]", *lines])


def rotation_angles_deg(rotation: Floats) -> tuple[float, float, float]:
    """Return the extrinsic x-y-z Euler angles of a rotation (3, 3): about the fixed x, then y, then z axis, degrees."""
    x = np.arctan2(rotation[2, 1], rotation[2, 2])
    y = np.arctan2(-rotation[2, 0], np.hypot(rotation[2, 1], rotation[2, 2]))
    z = np.arctan2(rotation[1, 0], rotation[0, 0])
    if np.hypot(rotation[2, 1], rotation[2, 2]) < 1e-9:  # gimbal lock: only the sum or difference of x and z is known
        x, z = np.arctan2(-rotation[1, 2], rotation[1, 1]), 0.0
    return float(np.degrees(x)), float(np.degrees(y)), float(np.degrees(z))


def _on_table(job: Job, machine: Machine, mesh: Mesh) -> PlacementConstraints:
    """Return the constraints of a part whose lowest point rests on the table."""
    table = job.placement
    up = np.array(table.up) / np.linalg.norm(table.up)
    # Up is towards the base.
    side = -1.0 if machine.work.centre[2] > 0.0 else 1.0
    lowest = float((mesh.vertices @ up).min())
    height = table.si.table_z - side * lowest
    x, y = (_EVERYWHERE if ends is None else tuple(ends.tolist()) for ends in (table.si.table_x, table.si.table_y))
    turn = (-np.pi, np.pi) if table.table_turn_deg is None else tuple(table.si.table_turn.tolist())
    return PlacementConstraints.table(height, x=x, y=y, up=up, normal=(0.0, 0.0, side), turn=turn)


def fixed_placement(table: TomlTable, wrong: Callable[..., InputError]) -> RigidTransform:
    """Return the placement of a table with mode "fixed". wrong: returns the error about a key that is not rigid."""
    if table.matrix is None:
        return pose_of(table.position_mm or (0.0, 0.0, 0.0), table.rotation_deg or (0.0, 0.0, 0.0))
    matrix = np.array(table.matrix)
    matrix[:3, 3] = to_si(matrix[:3, 3], "mm")
    try:
        return RigidTransform.from_matrix(matrix)
    except ArrayError as error:
        raise wrong("matrix", error.what, expected=error.expected) from error


def pose_of(position_mm: Sequence[float], rotation_deg: Sequence[float]) -> RigidTransform:
    """Return the placement at a position (mm), rotated about the fixed x, then y, then z axis (degrees)."""
    turns = to_si(rotation_deg, "deg")
    (cx, cy, cz), (sx, sy, sz) = np.cos(turns), np.sin(turns)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return RigidTransform(about_z @ about_y @ about_x, to_si(position_mm, "mm"))
