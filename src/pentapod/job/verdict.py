"""Verification of a program file, or of a run's folder, against its job."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pentapod.base.errors import ProgramError
from pentapod.base.progress import Progress, silent
from pentapod.job.artefacts import PROGRAM, SETUPS
from pentapod.job.build.pieces import job_of_program, job_part, program_piece, program_toolpath
from pentapod.job.build.reach import check_reach
from pentapod.job.build.specification import job_specification
from pentapod.job.build.toolpath import job_toolpath
from pentapod.job.build.values import job_machine, job_mesh
from pentapod.job.mending import most_left_out
from pentapod.job.outcome import setups_verdict
from pentapod.job.schema.job import Job
from pentapod.job.ways.claims import with_ways
from pentapod.machine.machine import Machine
from pentapod.toolpath.linking.partition import Piece, missed_cuts
from pentapod.verify import Verdict, judged


def judge(
    job: Job,
    program: str | Path,
    progress: Progress = silent,
    *,
    machine: Machine | None = None,
    strict: bool = False,
) -> Verdict:
    """Return the verdict on a program file, or on the folder of a run, against its job.

    A folder holds one program, or one for each set-up in setup-1, setup-2, and so on: then all of them are judged, and
    that together they make every cut once. The program of one set-up alone leaves that "not judged". machine: to be
    used instead of the one that the job names, as in `run`. strict as in `verify`. Raises InputError for a bad job,
    mesh or machine, and where there is no such program.

    >>> judge(Job.load("job.toml"), "out/program.csv").answer
    'passed'
    """
    path = Path(program)
    files = _programs(path) if path.is_dir() else [path]
    used, own_machine, mesh = job_machine(job, machine), machine is not None, job_mesh(job, progress)
    check_reach(job, used, mesh)
    if not path.is_dir() or (path / PROGRAM).is_file():
        job = job_of_program(job, files[0])
        specification = job_specification(
            job,
            used,
            mesh,
            lambda: program_toolpath(job, mesh, files[0], progress, machine=used, most=most_left_out(job)),
            own_machine=own_machine,
        )
        specification, claims = with_ways(specification, files[0].parent)
        return judged(files[0], specification, strict=strict, claims=claims, progress=progress)
    specification = job_specification(
        job, used, mesh, lambda: job_toolpath(job, mesh, progress, machine=used)[0], own_machine=own_machine
    )
    toolpath = specification.toolpath
    pieces = [program_piece(file) or Piece(0, len(toolpath) - 1) for file in files]
    cuts, missed = missed_cuts(toolpath, pieces)
    verdicts: list[tuple[int, Verdict]] = []
    for number, (file, piece) in enumerate(zip(files, pieces, strict=True), start=1):
        own = replace(specification, toolpath=job_part(job, mesh, toolpath, piece, machine=used), missed=missed)
        own, claims = with_ways(own, file.parent)
        verdicts.append((number, judged(file, own, strict=strict, claims=claims, progress=progress)))
    return setups_verdict(verdicts, cuts, missed, job.placement.setups)


def _programs(folder: Path) -> list[Path]:
    """Return the program files of a run's folder. Raises ProgramError where it has none, or both kinds."""
    one, several = folder / PROGRAM, sorted(folder.glob(f"{SETUPS}/{PROGRAM}"), key=_number)
    if one.is_file() and several:
        what = "this folder has a program and others for set-ups"
        raise ProgramError(what, file=folder, expected=f"either {PROGRAM} or setup-1, setup-2, ...")
    if not one.is_file() and not several:
        raise ProgramError("there is no program in this folder", file=folder, expected=PROGRAM)
    return several or [one]


def _number(file: Path) -> int:
    digits = file.parent.name.removeprefix("setup-")
    return int(digits) if digits.isascii() and digits.isdecimal() else 0
