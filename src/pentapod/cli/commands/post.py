"""pentapod post: write a program in the format of a controller."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from pentapod.cli.output import echo_json, json_option, note_changes, quiet_option
from pentapod.cli.progress import progress_bar

if TYPE_CHECKING:
    from pentapod.machine import Machine
    from pentapod.program import Program


def _print_formats(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    if value:
        from pentapod.program.posts import find_post, post_names

        width = max(len(name) for name in post_names())
        for name in post_names():
            click.echo(f"{name:<{width}}  {find_post(name).about}")
        ctx.exit()


def _complete_format(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[str]:
    from pentapod.program.posts import post_names

    del ctx, param
    return [name for name in post_names() if name.startswith(incomplete)]


@click.command()
@click.argument("program", type=click.Path(path_type=Path))
@click.option("--to", "name", required=True, shell_complete=_complete_format, help="Format; see --formats.")
@click.option("-o", "--out", required=True, type=click.Path(path_type=Path), help="Folder for the files.")
@click.option("--job", type=click.Path(path_type=Path), help="The job of the program; it names the machine.")
@click.option("--machine", help="The machine's name or file, without --job.")
@click.option("--plan", type=click.Path(path_type=Path),
              help="The run's plan.npz, for formats with the toolpath  [default: beside PROGRAM]")  # fmt: skip
@click.option("--verdict", type=click.Path(path_type=Path),
              help="The verdict on exactly this file  [default: verdict.json beside PROGRAM]")  # fmt: skip
@click.option("--from", "begin", metavar="TIME",
              help="Restart in the middle: what is left from this time on, 53.2 or 53.2s, with a checked way in from "
                   "the machine's park pose.")  # fmt: skip
@click.option("--no-ways", is_flag=True, help="Leave out the ways from the park pose and back.")
@click.option("--unverified", is_flag=True, help="Write without a passed verdict; every file is marked.")
@click.option("--formats", is_flag=True, expose_value=False, is_eager=True, callback=_print_formats,
              help="List the formats and exit.")  # fmt: skip
@json_option
@quiet_option
def post(
    program: Path,
    name: str,
    out: Path,
    job: Path | None,
    machine: str | None,
    plan: Path | None,
    verdict: Path | None,
    begin: str | None,
    no_ways: bool,
    unverified: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Write PROGRAM.csv in another format, if a verdict has passed for exactly this file.

    The machine is that of the run in PROGRAM's folder, by its job, else the shipped one that the program names. Where
    the program stands alone, name another one, or one with another tool or period, by --job or --machine. Installed
    packages add formats by entry points of the group pentapod.posts.

    If the machine has a park pose, the rows begin and end there: way_in.csv, PROGRAM.csv and way_out.csv as one. With
    --from they are planned anew from the last waypoint passed at that time; it is refused where no way in is clear.
    """
    if begin is not None:
        others = {
            "--no-ways": no_ways,
            "--unverified": unverified,
            "--machine": machine,
            "--plan": plan,
            "--verdict": verdict,
        }
        if wrong := [option for option, value in others.items() if value]:
            raise click.UsageError(
                f"--from plans and judges anew, from the park pose and back: {wrong[0]} does not go with it"
            )
        return _restarted(program, begin, name, out, job, as_json=as_json, quiet=quiet)
    from pentapod.base.files import sha256_of
    from pentapod.job.artefacts import ARRAYS, VERDICT
    from pentapod.job.ways.posted import from_park, ways_beside
    from pentapod.program import read_csv
    from pentapod.program.posts import PostInput, find_post, placed_toolpath, write_post
    from pentapod.program.posts.verified import check_passed

    takes_toolpath = find_post(name).takes_toolpath  # an unknown format fails at once
    note_changes(program.parent)
    with progress_bar(quiet=quiet or as_json) as progress:
        progress("reading", 0.0, program.name)
        read, digest = read_csv(program), sha256_of(program)
        if not unverified:
            verdict = program.with_name(VERDICT) if verdict is None else verdict
            check_passed(verdict, digest, program)
        beside = program.with_name(ARRAYS)
        plan = beside if plan is None and takes_toolpath and beside.exists() else plan
        toolpath = None if plan is None else placed_toolpath(plan, read)
        ways = {} if no_ways else ways_beside(program, read, None if unverified else verdict)
        progress("reading", 1.0, program.name)
        progress("writing", 0.0, name)
        given = PostInput(from_park(read, ways), program_machine(read, program.parent, job, machine), toolpath, digest)
        files = write_post(given, name, out, verdict=verdict, unverified=unverified)
    _show(files, name, unverified=unverified, as_json=as_json, quiet=quiet, lasing=read.laser_power is not None)
    return 0


def _show(files: list[Path], name: str, *, unverified: bool, as_json: bool, quiet: bool, lasing: bool) -> None:
    """Print the files that were written."""
    from pentapod.program.posts import find_post
    from pentapod.program.posts.registry import LASER_POWER

    if lasing and LASER_POWER in find_post(name).loses:
        click.echo(f"note: {name} does not hold the laser's power; csv, npz and linuxcnc do", err=True)
    if as_json:
        echo_json({"format": name, "verified": not unverified, "files": [str(file) for file in files]})
    elif not quiet:
        for file in files:
            click.echo(str(file))


def _restarted(program: Path, begin: str, name: str, out: Path, job: Path | None, *, as_json: bool, quiet: bool) -> int:
    """Write what is left of a program from a time on."""
    from pentapod.base.errors import InputError
    from pentapod.base.refusal import Refusal
    from pentapod.job.plan_arrays import job_file_of
    from pentapod.job.restart.restart import restart
    from pentapod.job.schema.job import Job
    from pentapod.program.posts import PostInput, find_post, write_post

    try:
        seconds = float(begin.strip().removesuffix("s"))
    except ValueError as error:
        raise InputError("not a time", key="--from", value=begin, expected="seconds, 53.2 or 53.2s") from error
    find_post(name)  # an unknown format fails at once
    job = job_file_of(program.parent) if job is None else job
    if job is None:
        raise InputError("a restart needs the job of the program", file=program, remedy="name it with --job")
    note_changes(program.parent)
    with progress_bar(quiet=quiet or as_json) as progress:
        found = restart(Job.load(job), program, seconds, progress)
        if isinstance(found, Refusal):
            files = None
        else:
            given = PostInput(found.program, found.machine, None, found.verdict.sources.program)
            try:
                files = write_post(given, name, out, verdict=found.verdict.to_dict())
            except InputError as error:
                if error.key != "plan":
                    raise
                what, remedy = "this format is the toolpath, not the rows", "choose a format of rows, such as csv"
                raise InputError(what, key="--to", value=name, remedy=remedy) from error
    if isinstance(found, Refusal) or files is None:
        if as_json:
            echo_json({"format": name, "refusal": str(found)})
        click.echo(f"refused: {found}", err=True)
        return 1
    click.echo(f"note: it begins where the program was at {found.begins:.3f} s, waypoint {found.waypoint}", err=True)
    _show(files, name, unverified=False, as_json=as_json, quiet=quiet, lasing=found.program.laser_power is not None)
    return 0


def program_machine(program: Program, folder: Path, job: Path | None, machine: str | None) -> Machine | None:
    """Return the named machine, that of the run in a folder, or the shipped one that the program names; else None."""
    from pentapod.base.errors import MachineError
    from pentapod.job.build.values import job_machine
    from pentapod.job.plan_arrays import job_file_of
    from pentapod.job.schema.job import Job
    from pentapod.machine import Machine

    if job is None and machine is not None:
        return Machine.load(machine)
    job = job_file_of(folder) if job is None else job  # its machine may have springs and screws that no digest knows
    if job is not None:
        return job_machine(Job.load(job))
    try:
        return Machine.load(program.provenance.machine)
    except MachineError:
        return None
