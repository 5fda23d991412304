"""OpenedRun: a run read back from its folder, with its job, for the viewer."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pentapod.base.archives import check_array, read_arrays
from pentapod.base.arrays import Floats
from pentapod.base.errors import InputError
from pentapod.base.progress import Progress, silent
from pentapod.base.values import Value
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import tangent_frame
from pentapod.geometry.rigid import RigidTransform
from pentapod.job.artefacts import ARRAYS, PROGRAM
from pentapod.job.build.specification import job_collision_world
from pentapod.job.build.tool import job_tool
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.job.outcome import Outcome, SetUp
from pentapod.job.plan_arrays import BOX, GUIDES, JOB_FILE, WAYPOINTS, guides_in, piece_in
from pentapod.job.run_folder import check_run
from pentapod.job.schema.job import Job
from pentapod.kinematics.component import Component
from pentapod.kinematics.robot import Branch, own_branch
from pentapod.machine.clearance.collision_world import CollisionWorld
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.planning import PlacedPath
from pentapod.program import Program, read_csv
from pentapod.toolpath.formats import read_toolpath
from pentapod.toolpath.linking.partition import Piece
from pentapod.toolpath.toolpath import Toolpath

_FORMS: dict[str, tuple[str, tuple[int | None, ...]]] = {
    JOB_FILE: ("U", ()),
    WAYPOINTS: ("i", (2,)),
    BOX: ("f", (2, 3)),
    GUIDES: ("f", (None,)),
    "placed.placement_mm": ("f", (4, 4)),
    "placed.component": ("i", (2,)),
    "placed.axes": ("f", (None, 3)),
}
"""Arrays of plan.npz: kinds of numbers, as NumPy names them, and shapes."""


@dataclass(frozen=True, eq=False)
class OpenedRun(Value):
    """A run. placement: workpiece → machine. axes (N, 3): the chosen tool axes, workpiece frame.

    machine: with its guides as in the program.
    piece: of the job's toolpath, where the run is one of several set-ups.
    program: None where the job was refused; then the part is in the middle of the work volume with nominal axes,
    unless a placement was found (is_placed). same_job: whether the program was made from the job as it is now.
    """

    folder: Path
    job: Job
    machine: Machine
    mesh: Mesh
    tool: Tool
    toolpath: Toolpath
    collision_world: CollisionWorld
    placement: RigidTransform
    component: Branch
    axes: Floats
    program: Program | None
    same_job: bool
    piece: Piece | None = None
    is_placed: bool = True


def open_run(folder: str | Path, job: str | Path | None = None, progress: Progress = silent) -> OpenedRun:
    """Return the run of a folder. job: its job file, by default the one that the run names.

    Raises InputError: no run in the folder, one in several set-ups, or files of different runs; the job file is gone; a
    broken file.
    """
    folder = Path(folder)
    file = folder / ARRAYS
    if not file.is_file():
        what = "there is no run in this folder" if folder.is_dir() else "no such folder"
        raise InputError(what, file=folder, expected=f"a folder with {ARRAYS}", remedy="pentapod plan JOB.toml -o DIR")
    if (first := folder / SetUp.folder_of(1)).is_dir():
        what = "this job has several set-ups, each of which is a run"
        raise InputError(what, file=folder, expected="the folder of one of them", remedy=f"pentapod view {first}")
    check_run(folder)
    progress("open", 0.0, "arrays")
    toolpath = read_toolpath(file, "npz")
    arrays = _arrays(file)
    loaded = Job.load(_job_file(folder, arrays) if job is None else job)
    progress("open", 0.3, "mesh")
    machine, mesh = job_machine(loaded), job_mesh(loaded)
    progress("open", 0.7, "program")
    program = read_csv(folder / PROGRAM) if (folder / PROGRAM).is_file() else None
    rail_positions = guides_in(arrays) if program is None else program.rail_positions
    machine = machine if rail_positions is None or machine.guides is None else machine.at(rail_positions)
    wanted = loaded.placement.component
    asked = machine.robot.branches[0] if wanted is None else Component.parse(wanted)
    placement, component, axes = _placed(arrays, toolpath, machine, asked)
    return OpenedRun(
        folder, loaded, machine, mesh, job_tool(loaded, machine), toolpath, job_collision_world(loaded, machine, mesh),
        placement, component, axes, program, program is None or program.provenance.job_digest == loaded.digest,
        piece_in(arrays), is_placed="placed.axes" in arrays,
    )  # fmt: skip


def run_of(outcome: Outcome, folder: Path) -> OpenedRun | None:
    """Return the run of an outcome that was written into a folder; None where there is no program."""
    mesh, toolpath = outcome.find(Mesh), outcome.find(Toolpath)
    placed, program = outcome.find(PlacedPath), outcome.find(Program)
    if mesh is None or toolpath is None or placed is None or program is None:
        return None
    job, machine, placement = outcome.job, outcome.machine, placed.placement.transform
    return OpenedRun(
        folder, job, machine, mesh, job_tool(job, machine), toolpath, job_collision_world(job, machine, mesh),
        placement, placed.component, placement.inverse().rotate(placed.axes), program, same_job=True,
        piece=outcome.find(Piece),
    )  # fmt: skip


def _arrays(file: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of the placement and of the set-up, as far as there are any, and of the job's file."""
    arrays = read_arrays(file, (), InputError, optional=_FORMS)
    for name, values in arrays.items():
        check_array(values, name, file, InputError, *_FORMS[name])
    return arrays


def _job_file(folder: Path, arrays: dict[str, NDArray[Any]]) -> Path:
    remedy = "name it with --job"
    if JOB_FILE not in arrays:
        raise InputError("the run does not name its job", file=folder / ARRAYS, remedy=remedy)
    path = folder / str(arrays[JOB_FILE])
    if not path.is_file():
        raise InputError("the job file of this run is gone", file=path, remedy=remedy)
    return path


def _placed(
    arrays: dict[str, NDArray[Any]], toolpath: Toolpath, machine: Machine, component: Branch
) -> tuple[RigidTransform, Branch, Floats]:
    """Return the run's placement, component and axes; without one the middle of the work volume, in `component`."""
    if "placed.axes" not in arrays:
        return _middle(toolpath, machine, component), component, toolpath.axes
    matrix = arrays["placed.placement_mm"].copy()
    matrix[:3, 3] *= 1e-3
    placement = RigidTransform.from_matrix(matrix)
    w, s = (int(sign) for sign in arrays["placed.component"])
    return placement, Component(w, s), placement.inverse().rotate(arrays["placed.axes"])


def _middle(toolpath: Toolpath, machine: Machine, component: Branch) -> RigidTransform:
    """Return the placement with the path in the middle of the work volume, its mean axis along the machine's z."""
    mean = toolpath.axes.mean(axis=0)
    length = float(np.linalg.norm(mean))
    axis = mean / length if length > 1e-6 else np.array([0.0, 0.0, 1.0])
    upward = np.array([0.0, 0.0, -float(own_branch(machine.robot, component).w)])
    to, back = (np.column_stack([*tangent_frame(a), a]) for a in (upward, axis))
    u, _, v = np.linalg.svd(to @ back.T)
    rotation = u @ v
    return RigidTransform(rotation, machine.work.centre - rotation @ toolpath.tips.mean(axis=0))
