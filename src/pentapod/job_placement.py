"""From a job's table [placement] to the placements that the planner may choose from."""

from __future__ import annotations

import numpy as np

from pentapod.arrays import Floats
from pentapod.errors import ArrayError
from pentapod.geometry.rigid import RigidTransform
from pentapod.job import Job
from pentapod.machine.machine import Machine
from pentapod.planning.freedom import FREE, Freedom
from pentapod.planning.weights import Weights
from pentapod.table import Vector
from pentapod.toolpath.mesh import Mesh

_MM = 1e-3
_EVERYWHERE = (-np.inf, np.inf)


def job_freedom(job: Job, machine: Machine, mesh: Mesh) -> Freedom:
    """Return the placements that the job allows. Raises JobError where its matrix is not rigid."""
    table = job.placement
    if table.mode == "fixed":
        return Freedom.fixture([_fixed(job)])
    if table.mode == "fixture":
        poses = np.array(table.poses_mm_deg, dtype=np.float64)
        return Freedom.fixture([_pose(pose[:3], pose[3:]) for pose in poses])
    if table.mode == "table":
        return _on_table(job, machine, mesh)
    if table.box_mm is None and table.largest_turn_deg is None:
        return FREE
    corners = np.array([[-np.inf] * 3, [np.inf] * 3]) if table.box_mm is None else np.array(table.box_mm) * _MM
    turn = 180.0 if table.largest_turn_deg is None else table.largest_turn_deg
    reference = _pose(np.zeros(3), table.rotation_deg or (0.0, 0.0, 0.0))
    low, high = corners.min(axis=0), corners.max(axis=0)
    return Freedom.free(low=low, high=high, reference=reference, largest_turn=float(np.radians(turn)))


def job_weights(job: Job) -> Weights:
    """Return the weights of the margins that the job asks for."""
    table = job.placement
    return Weights(table.weight_strokes, table.weight_singularities, table.weight_joints, table.weight_bodies)


def _on_table(job: Job, machine: Machine, mesh: Mesh) -> Freedom:
    """Return the freedom of the job's part standing on the table with its lowest point."""
    table = job.placement
    up = np.array(table.up) / np.linalg.norm(table.up)
    # Up is towards the base: away from where the machine works.
    side = -1.0 if machine.work.centre[2] > 0.0 else 1.0
    lowest = float((mesh.vertices @ up).min())
    height = float(table.table_z_mm or 0.0) * _MM - side * lowest
    x, y = (
        _EVERYWHERE if values is None else (values[0] * _MM, values[1] * _MM)
        for values in (table.table_x_mm, table.table_y_mm)
    )
    return Freedom.table(height, x=x, y=y, up=up, normal=(0.0, 0.0, side))


def _fixed(job: Job) -> RigidTransform:
    table = job.placement
    if table.matrix is None:
        return _pose(np.array(table.position_mm), table.rotation_deg or (0.0, 0.0, 0.0))
    matrix = np.array(table.matrix)
    matrix[:3, 3] *= _MM
    try:
        return RigidTransform.from_matrix(matrix)
    except ArrayError as error:
        raise job.error("placement", "matrix", error.what, expected=error.expected) from error


def _pose(position_mm: Floats, rotation_deg: Vector | Floats) -> RigidTransform:
    """Return the placement at a position (mm) after turns about the fixed x, then y, then z axis (degrees)."""
    cx, cy, cz = np.cos(np.radians(rotation_deg))
    sx, sy, sz = np.sin(np.radians(rotation_deg))
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return RigidTransform(about_z @ about_y @ about_x, position_mm * _MM)
