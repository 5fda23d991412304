"""Specification from a job: everything that its program is verified against."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256

import numpy as np

from pentapod.base.errors import InputError, MachineError
from pentapod.base.files import sha256_of
from pentapod.job.build.other_ways import stands
from pentapod.job.build.placement import job_constraints
from pentapod.job.build.region import covers_region, job_region
from pentapod.job.build.tool import job_tool
from pentapod.job.build.toolpath import job_depth, job_options, job_toolpath, tool_in_world
from pentapod.job.build.values import is_compensated
from pentapod.job.schema.job import Job
from pentapod.kinematics.component import Component
from pentapod.machine.clearance.collision_world import CollisionWorld
from pentapod.machine.machine import Machine
from pentapod.machine.reader import calibration_bytes, machine_bytes
from pentapod.mesh.io.load import load_mesh
from pentapod.mesh.mesh import Mesh
from pentapod.program.program import GRAVITY, PROCESS
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify import Coverage, Cutting, Specification
from pentapod.verify.verdict.verdict import Sources

LEANS = 0.25 * np.pi
"""How far from the view a tool might lean on any machine: what only such a lean reaches is told."""


def job_specification(
    job: Job, machine: Machine, mesh: Mesh, make_toolpath: Callable[[], Toolpath], *, own_machine: bool = False
) -> Specification:
    """Return the requirements of a job on its program. machine: from `job_machine`; mesh: the job's.

    make_toolpath: called last, so that errors of the job's tables come before the long computation. own_machine:
    whether the machine is a value of the caller, of no file.
    Raises JobError where tables of the job do not go with the machine or the mesh.
    """
    collision_world, constraints = job_collision_world(job, machine, mesh), job_constraints(job, machine, mesh)
    cutting, component = job_cutting(job, collision_world, machine), job.placement.component
    return Specification(
        machine,
        make_toolpath(),
        tilt=job.axis.si.tilt,
        path_tolerance=job.tolerance.si.path,
        axis_tolerance=job.tolerance.si.axis,
        job_digest=job.digest,
        collision_world=collision_world,
        cutting=cutting,
        constraints=constraints,
        component=None if component is None else Component.parse(component),
        compensation=_compensation(job, machine),
        deflection=job.tolerance.si.deflection,
        lowest_share=job.feed.lowest_share,
        stop_angle=job.feed.si.stop_angle,
        setups=job.placement.setups,
        waived=job.verify.waive,
        sources=_sources(job, own_machine=own_machine),
    )


def _compensation(job: Job, machine: Machine) -> str:
    """Return the loads that drives must compensate for, as a specification says it."""
    if not is_compensated(job, machine):
        return ""
    return PROCESS if job.output.compensation == PROCESS else GRAVITY


def job_collision_world(job: Job, machine: Machine, mesh: Mesh) -> CollisionWorld:
    """Return the part, its fixture, legs, spindle and tool; mesh: the part's.

    Raises JobError where the tool does not go with the machine.
    """
    held = job_fixture(job)
    name = "fixture" if job.fixture.frame == "part" else "table"
    around = {} if held is None else {name: held}
    try:
        allowance = job.gouge.si.tolerance + job_depth(job)  # an engraving lies below the surface on purpose
        return CollisionWorld.of(machine, tool_in_world(job, machine), mesh, **around, allowance=allowance)
    except MachineError as error:
        remedy = "a longer tool.length_mm, or a shorter holder"
        raise job.error("tool", "holder_mm", error.what, expected=error.expected, remedy=remedy) from error


def job_fixture(job: Job) -> Mesh | None:
    """Return the mesh of the job's fixture, in the frame that the job says; None without one. Raises MeshError."""
    if job.fixture_mesh is None:
        return None
    return load_mesh(job.fixture_mesh, job.fixture.unit, scale=job.fixture.scale)


def job_cutting(job: Job, collision_world: CollisionWorld, machine: Machine | None = None) -> Cutting | None:
    """Return the bodies that cut and the largest depth, for the part of a collision world; None without a part.

    The tolerance of the gouge check, and the depth of an engraving, count as no gouge. Raises JobError where the tool's
    sizes make no tool.
    """
    depth = job.gouge.si.tolerance + job_depth(job)
    for obstacle in collision_world.obstacles:
        if obstacle.name == "part":
            mesh = obstacle.surface.mesh
            solids = job_tool(job, machine).solids
            coverage = replace(job_coverage(job, mesh, machine), one_direction=job.axis.mode == "fixed")
            if stands(job):
                coverage = replace(coverage, leans=LEANS)
            return Cutting(obstacle.surface, solids, depth, coverage)
    return None


def job_coverage(job: Job, mesh: Mesh, machine: Machine | None = None) -> Coverage:
    """Return the region that a job's program must machine; none where its strategy covers no surface.

    With `left_mm` in the job, the region must be machined whatever the strategy.
    """
    strategy, tolerance = job.toolpath.strategy, job.tolerance.si
    covers = covers_region(job)
    if not covers and tolerance.left is None:
        return Coverage.nothing(f'the strategy "{strategy}" covers no region')
    return Coverage.of(
        mesh,
        job_tool(job, machine),
        job_options(job) if covers else PathOptions(region=job_region(job)),
        path_tolerance=tolerance.path,
        left=tolerance.left,
        share=tolerance.left_share,
        whole=lambda: job_toolpath(job, mesh, machine=machine)[0],
    )


def _sources(job: Job, *, own_machine: bool) -> Sources:
    """Return the SHA-256 of a job's files. Raises MachineError where the machine's file is gone."""
    name = job.machine_file or str(job.machine.name)
    machine = None if own_machine else machine_bytes(name)
    calibration = None if own_machine else calibration_bytes(name)
    return Sources(
        job=_job_file(job),
        machine=None if machine is None else sha256(machine).hexdigest(),
        calibration=None if calibration is None else sha256(calibration).hexdigest(),
        mesh=sha256_of(job.mesh_path),
        fixture=None if job.fixture_mesh is None else sha256_of(job.fixture_mesh),
        **{f"toolpath_{key}": sha256_of(file) for key, file in job.files.items()},
    )


def _job_file(job: Job) -> str | None:
    """Return the SHA-256 of a job's file; None where the file says something else than the job."""
    try:
        return sha256_of(job.path) if Job.load(job.path).tables == (job.asked or job).tables else None
    except (InputError, OSError):
        return None
