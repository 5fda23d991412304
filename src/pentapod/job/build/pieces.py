"""Parts of a job's toolpath: one of several set-ups, or all but what the machine cannot do; also that of a program."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pentapod.base.errors import InputError, ProgramError
from pentapod.base.progress import Progress, silent
from pentapod.job.build.other_ways import as_made
from pentapod.job.build.process import continued, with_process
from pentapod.job.build.toolpath import drops_gouges, gouge_options, job_link_style, job_toolpath, judged_tool
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.program import read_header
from pentapod.program.program import Provenance
from pentapod.toolpath.gouge.gouge import without_gouges
from pentapod.toolpath.linking.links import LinkStyle
from pentapod.toolpath.linking.partition import Piece, part_of, share_left_out, without_cuts
from pentapod.toolpath.toolpath import Toolpath


def job_piece(
    job: Job, mesh: Mesh, piece: Piece, progress: Progress = silent, *, machine: Machine | None = None
) -> Toolpath:
    """Return a piece of the job's toolpath, as `job_part`. Raises ToolpathError as `part_of`."""
    toolpath, _ = job_toolpath(job, mesh, progress, machine=machine)
    return job_part(job, mesh, toolpath, piece, machine=machine)


def job_part(job: Job, mesh: Mesh, toolpath: Toolpath, piece: Piece, *, machine: Machine | None = None) -> Toolpath:
    """Return a piece of the job's toolpath as `part_of`, with links that are clear of the part.

    Raises ToolpathError as `part_of`.
    """
    style = job_link_style(job, mesh, toolpath)
    part = _cleared(job, mesh, part_of(toolpath, piece, style), style, machine)
    return with_process(job, continued(toolpath, part, int(piece.cuts(toolpath).argmax())))


def job_without(
    job: Job, mesh: Mesh, toolpath: Toolpath, left_out: Sequence[tuple[int, int]], *, machine: Machine | None = None
) -> Toolpath:
    """Return the job's toolpath as `without_cuts`, with links that are clear of the part. Raises as `without_cuts`."""
    style = job_link_style(job, mesh, toolpath)
    return with_process(job, _cleared(job, mesh, without_cuts(toolpath, left_out, style), style, machine))


def _cleared(job: Job, mesh: Mesh, part: Toolpath, style: LinkStyle, machine: Machine | None) -> Toolpath:
    if not drops_gouges(job):
        return part
    return without_gouges(part, judged_tool(job, machine), mesh, gouge_options(job, (), style))[0]


def program_toolpath(
    job: Job,
    mesh: Mesh,
    program: Path,
    progress: Progress = silent,
    *,
    machine: Machine | None = None,
    most: float = 1.0,
) -> Toolpath:
    """Return the toolpath of a program file: the job's, its set-up's piece of it, or what it does not leave out.

    machine: as for `job_tool`. most: share of the cuts that the program may leave out. Raises ProgramError where it
    leaves out more, ToolpathError where its header names no cuts of the toolpath.
    """
    made_from = _provenance(program)
    if made_from is not None and made_from.piece is not None:
        return job_piece(job, mesh, made_from.piece, progress, machine=machine)
    job = job_of_program(job, program)
    toolpath = job_toolpath(job, mesh, progress, machine=machine)[0]
    if made_from is None or not made_from.left_out:
        return toolpath
    share = share_left_out(toolpath, made_from.left_out)
    if share > most:
        raise ProgramError(
            "the program leaves out more cuts than it may", file=program, key="left_out",
            value=f"{100.0 * share:.3g} %",
            expected=f"at most {100.0 * most:.3g} % of the cuts" if most else "all cuts of this job",
            remedy="plan the job again",
        )  # fmt: skip
    return job_without(job, mesh, toolpath, made_from.left_out, machine=machine)


def job_of_program(job: Job, program: Path) -> Job:
    """Return the job as a program file does it: in another way, where its header says so and the job lets it."""
    made_from = _provenance(program)
    return job if made_from is None else as_made(job, made_from)


def program_piece(program: Path) -> Piece | None:
    """Return the piece of the toolpath that a program file is for; None for all of it, or for a broken file."""
    made_from = _provenance(program)
    return None if made_from is None else made_from.piece


def _provenance(program: Path) -> Provenance | None:
    try:
        return read_header(program).provenance
    except InputError:  # the verdict names the error
        return None
