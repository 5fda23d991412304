"""Machine, mesh and toolpath from a job."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from pentapod.base.errors import InputError, MachineError, MeshError
from pentapod.base.keys import fields_from
from pentapod.base.progress import Progress, silent
from pentapod.job.build.strategy import check_sizes, job_options
from pentapod.job.build.tool import FileReport, Reports, finished_as_asked, job_link_style, job_tool
from pentapod.job.schema.job import Job
from pentapod.job.schema.strategies import FileTable
from pentapod.machine.machine import Machine
from pentapod.machine.parts import ControllerSettings
from pentapod.machine.tool_limits import ToolLimits
from pentapod.program import read_header
from pentapod.toolpath import Mesh, Tool, Toolpath, load_mesh, toolpath_with_report
from pentapod.toolpath.formats import read_toolpath
from pentapod.toolpath.linking.partition import Piece, part_of


def job_machine(job: Job) -> Machine:
    """Return the job's machine, with its tool length, controller settings and tool limits. Raises MachineError."""
    machine = Machine.load(job.machine_file or str(job.machine.name))
    controller = ControllerSettings(
        period=machine.controller.period if job.output.period_ms is None else job.output.si.period,
        interpolation=job.output.interpolation or machine.controller.interpolation,
    )
    length = machine.tool_length if job.tool.length_mm is None else job.tool.si.length
    limits = machine.tool_limits.and_(ToolLimits(**fields_from(ToolLimits, job.feed)))
    try:
        return dataclasses.replace(machine, controller=controller, tool_length=length, tool_limits=limits)
    except MachineError as error:
        raise job.error("tool", "length_mm", error.what) from error


def job_mesh(job: Job, progress: Progress = silent) -> Mesh:
    """Return the job's mesh. Raises MeshError, or JobError where its unit, or lengths of the job, do not suit it."""
    part = job.part
    try:
        mesh = load_mesh(job.mesh_path, part.unit, scale=part.scale, repair=part.repair, progress=progress)
    except MeshError as error:
        if error.key != "unit":
            raise
        raise job.error("part", "unit", error.what, expected=error.expected, remedy=error.remedy) from error
    check_sizes(job, mesh)
    return mesh


def job_toolpath(job: Job, mesh: Mesh, progress: Progress = silent) -> tuple[Toolpath, Reports]:
    """Return the job's toolpath, workpiece frame, and its reports.

    Raises ToolpathError where nothing is there to machine, or the toolpath file cannot be read.
    """
    tool = job_tool(job)
    toolpath, report = _drawn(job, mesh, tool)
    toolpath, gouges = finished_as_asked(job, mesh, tool, toolpath, progress)
    if job.feed.dwell_s is not None:
        toolpath = toolpath.stopping(job.feed.dwell_s)
    return toolpath, Reports((report, gouges))


def job_piece(job: Job, mesh: Mesh, piece: Piece, progress: Progress = silent) -> Toolpath:
    """Return a piece of the job's toolpath, with the ways to it and from it. Raises ToolpathError as `part_of`."""
    toolpath, _ = job_toolpath(job, mesh, progress)
    return part_of(toolpath, piece, job_link_style(job, mesh, toolpath))


def program_toolpath(job: Job, mesh: Mesh, program: Path, progress: Progress = silent) -> Toolpath:
    """Return the toolpath that a program file is about: the job's, or its set-up's piece of it."""
    try:
        piece = read_header(program).provenance.piece
    except InputError:  # the verdict says what is wrong with the file
        piece = None
    return job_toolpath(job, mesh, progress)[0] if piece is None else job_piece(job, mesh, piece, progress)


def _drawn(job: Job, mesh: Mesh, tool: Tool) -> tuple[Toolpath, object]:
    """Return the toolpath of the strategy or of the file, and its report."""
    if isinstance(job.toolpath, FileTable):
        file = job.file("file")
        read = read_toolpath(file, job.toolpath.format, tilt_centre=tool.tilt_centre, feed=job.feed.si.cut)
        # Whatever the file says of its tool, this job's is the one that moves.
        read = dataclasses.replace(read, tilt_centre=tool.tilt_centre)
        return read, FileReport(file.name, len(read), len(read.segments))
    return toolpath_with_report(mesh, tool, job_options(job))
