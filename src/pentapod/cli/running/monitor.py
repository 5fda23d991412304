"""pentapod monitor: a recorded run against its program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from pentapod.cli.numbers import Real
from pentapod.cli.output import HtmlFile, echo_json, json_option, quiet_option
from pentapod.cli.progress import progress_bar

if TYPE_CHECKING:
    from pentapod.machine import Machine
    from pentapod.program import Program


@click.command()
@click.argument("log", type=click.Path(path_type=Path))
@click.option("--program", type=click.Path(path_type=Path), metavar="FILE|DIR",
              help="The program, or the folder of its run.  [default: program.csv beside LOG]")  # fmt: skip
@click.option("--job", type=click.Path(path_type=Path),
              help="The job of the program; it names machine and tolerances.  [default: that of the run]")  # fmt: skip
@click.option("--machine", help="The machine's name or file, without a job.")
@click.option("--columns", metavar="NAMES",
              help="What the columns are, such as number,commands_mm,legs_mm,-; else titles say it.")  # fmt: skip
@click.option("--period-ms", "period_ms", type=Real(0.0, min_open=True), metavar="MS",
              help="Time between rows, where no column says it.  [default: the program's period]")  # fmt: skip
@click.option("--tolerance-mm", "tolerance_mm", type=Real(0.0, min_open=True), metavar="MM",
              help="Fail if the contour error is larger.  [default: the job's tolerance.path_mm]")  # fmt: skip
@click.option("--axis-tolerance-deg", "axis_deg", type=Real(0.0, min_open=True), metavar="DEG",
              help="Fail if the axis error is larger.")  # fmt: skip
@click.option("-o", "--out", type=HtmlFile(), metavar="FILE.html",
              help="Write an HTML page with all measures against time.")  # fmt: skip
@json_option
@quiet_option
def monitor(
    log: Path, program: Path | None, job: Path | None, machine: str | None, columns: str | None,
    period_ms: float | None, tolerance_mm: float | None, axis_deg: float | None, out: Path | None, as_json: bool,
    quiet: bool,
) -> int:  # fmt: skip
    """Compare LOG, the legs as they were recorded while a program ran, with the program.

    LOG is the output of LinuxCNC's halsampler, or CSV. The run may start and end anywhere in it. Contour errors are
    those from the programmed path at any time, so that feed override and feed hold do not count; a run without them is
    also compared in time. Errors of each leg are told apart as offset, scale, drift and lag. Where the toolpath is
    known, from the plan.npz beside the program, cuts alone are judged.

    The exit code is 1 if a tolerance is exceeded.
    """
    from pentapod.base.errors import InputError
    from pentapod.job.artefacts import ARRAYS, PROGRAM
    from pentapod.job.plan_arrays import job_file_of
    from pentapod.job.schema.job import Job
    from pentapod.program import read_csv
    from pentapod.program.commands import read_back
    from pentapod.program.posts import placed_toolpath
    from pentapod.simulate import Reference
    from pentapod.simulate.recorded.comparison import compare
    from pentapod.simulate.recorded.run_log import read_log

    file = log.with_name(PROGRAM) if program is None else program / PROGRAM if program.is_dir() else program
    if program is None and not file.exists():
        raise InputError("no program is beside the log", file=log, remedy="name it, or its run, by --program")
    with progress_bar(quiet=quiet or as_json) as progress:
        progress("reading", 0.0, file.name)
        read = read_csv(file)
        job = job_file_of(file.parent) if job is None and machine is None else job
        asked = None if job is None else Job.load(job).tolerance
        used = _machine(read, file.parent, job, machine)
        reference = Reference(read_back(read, used), used)
        progress("reading", 0.5, log.name)
        recorded = read_log(log, read.legs.shape[1], 1e-3 * period_ms if period_ms else read.period, columns)
        progress("comparing", 0.0)
        plan = file.with_name(ARRAYS)
        toolpath = placed_toolpath(plan, read) if plan.exists() else None
        run = compare(recorded, reference, toolpath, *([] if asked is None else [1e-3 * asked.path_mm]))
    bounds = {
        "contour error": tolerance_mm or (None if asked is None else asked.path_mm),
        "axis error": axis_deg,
    }
    failed = {name: bound for name, bound in bounds.items() if bound is not None and run.largest(name) > bound}
    title, lines = f"{log.name}: a run of {file.name}", run.lines()
    if out is not None:
        from pentapod.report import write_recorded

        write_recorded(out, title, lines, run)
    if as_json:
        judged = {name.replace(" ", "_"): bound for name, bound in bounds.items()}
        content = {"passed": not failed, "tolerances": judged, **run.to_dict()}
        echo_json({"log": str(log), "program": str(file), **content, **({} if out is None else {"page": str(out)})})
    elif not quiet:
        click.echo("\n".join([title, *lines, *([] if out is None else [f"  page: {out}"])]))
        if bounds["contour error"] is None:
            click.echo("not judged: no job says a tolerance; give --tolerance-mm or --job", err=True)
    for name, bound in failed.items():
        unit = "mm" if name == "contour error" else "deg"
        click.echo(f"the {name}, {run.largest(name):.3g} {unit}, exceeds {bound:g} {unit}", err=True)
    return 1 if failed else 0


def _machine(read: Program, folder: Path, job: Path | None, machine: str | None) -> Machine:
    """Return the machine of a program. Raises InputError where it is unknown, or another one."""
    from pentapod.cli.commands.post import program_machine
    from pentapod.program.posts import PostInput

    return PostInput(read, program_machine(read, folder, job, machine)).the_machine()
