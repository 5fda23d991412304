"""pentapod plan: plan a job and write its files."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pentapod.cli.output import advice_text, echo_json, json_option, quiet_option, verdict_text
from pentapod.cli.progress import progress_bar

if TYPE_CHECKING:
    from pentapod.job.advice.options import AdviceOptions
    from pentapod.job.outcome import Outcome
    from pentapod.job.schema.job import Job


@click.command()
@click.argument("job", type=click.Path(path_type=Path))
@click.option("-o", "--out", type=click.Path(path_type=Path), default=Path("out"), show_default=True,
              help="Folder for the files.")  # fmt: skip
@click.option("--explain", is_flag=True, help="Print the nearest limits: where, and by how much.")
@click.option("--advice", type=click.IntRange(0), metavar="N",
              help="Changes to find with which a job that cannot be done is planned; 0: do not search. "
                   "1 when left out, but 0 where the error says which unit the part must have.")  # fmt: skip
@click.option("--placement", type=click.Path(path_type=Path), metavar="FILE",
              help="Fix the part where `pentapod register` found it; writes placed-job.toml, too.")  # fmt: skip
@json_option
@quiet_option
def plan(
    job: Path, out: Path, explain: bool, advice: int | None, placement: Path | None, as_json: bool, quiet: bool
) -> int:
    """Plan JOB.toml: write program.csv, verdict.json, report.html and plan.npz.

    The folder changes only when the run ends, so that its files are always of one run. A job that cannot be done leaves
    no program.csv, nor does a program that fails its verdict: that one is called withheld.csv. Changes of a job that
    cannot be done are searched for and planned, and those whose verdict passed are printed. A job in several set-ups
    has a folder of files for each: setup-1, setup-2, and so on.

    Ctrl-C during the search for a placement continues with the best one so far, if that fits. During the
    search for changes it ends that. At any other time it ends the command and changes nothing.
    """
    from pentapod.base.errors import InputError
    from pentapod.job.schema.job import Job

    loaded = Job.load(job)

    from pentapod.job.advice.options import AdviceOptions
    from pentapod.job.advice_on_errors import can_help
    from pentapod.job.artefacts import REPORT
    from pentapod.job.pipeline import run

    options = None if advice == 0 else AdviceOptions(wanted=advice or 1)
    if placement is not None:
        from pentapod.job.clamped.placed_job import placed_job, read_placement

        loaded = placed_job(loaded, read_placement(placement), out)
    try:
        with progress_bar(quiet=quiet or as_json) as progress:
            outcome = run(loaded, out, progress, writers={REPORT: _write_report}, advice=options)
    except InputError as error:
        if options is None or not can_help(error) or (advice is None and error.key == "part.unit"):
            raise
        click.echo(f"error: {error}", err=True)  # at once: the search takes as long as a plan or two
        return _advised(loaded, options, as_json=as_json, quiet=quiet)
    return shown(outcome, out, explain=explain, as_json=as_json, quiet=quiet)


def shown(outcome: Outcome, out: Path, *, explain: bool, as_json: bool, quiet: bool) -> int:
    """Print the outcome of a run in a folder and return the exit code."""
    from pentapod.job.artefacts import PROGRAM, REPORT
    from pentapod.job.outcome import SetUps
    from pentapod.planning import PlacedPath
    from pentapod.planning.diagnosis import active_limits
    from pentapod.timing import Explanation

    refusal = outcome.refusal
    if as_json:
        seconds = {stage.name: round(stage.seconds, 3) for stage in outcome.stages}
        story = outcome.find(Explanation)
        more: dict[str, Any] = {} if story is None else {"timing": story.to_dict()}
        if explain and (placed := outcome.find(PlacedPath)) is not None:
            more["limits"] = [dataclasses.asdict(limit) for limit in active_limits(placed)]
        echo_json({**outcome.to_dict(), **more, "out": str(out), "seconds": seconds})
    elif not quiet:
        click.echo("\n".join(stage.remark for stage in outcome.stages if stage.remark))
        if explain:
            click.echo(_explained(outcome))
        if refusal is None:
            click.echo(verdict_text(outcome.verdict))
            setups = outcome.find(SetUps)
            folders = [out] if setups is None else [out / part.folder for part in setups.parts]
            click.echo("\n".join(f"program: {folder / PROGRAM}" for folder in folders))
        click.echo(f"report: {out / REPORT}")
    if refusal is not None:
        click.echo(f"refused: {refusal}", err=True)
        click.echo(advice_text(refusal.advice), err=True, nl=bool(refusal.advice))
    elif not outcome.passed and quiet:
        click.echo("the verdict failed", err=True)
    return 0 if outcome.passed else 1


def _write_report(outcome: Outcome, file: Path) -> None:
    from pentapod.report import write_report

    write_report(outcome, file)


def _advised(job: Job, options: AdviceOptions, *, as_json: bool, quiet: bool) -> int:
    """Search for advice for a job that is an error, print it, and return the exit code of the error."""
    from pentapod.base.errors import InputError
    from pentapod.cli.main import EXIT_INPUT
    from pentapod.job.advice_on_errors import advise

    try:
        with progress_bar(quiet=quiet or as_json) as progress:
            found = advise(job, options=options, progress=progress)
    except InputError:  # the one that was printed: nothing can be tried before it is mended
        return EXIT_INPUT
    if as_json:
        echo_json({"advice": [each.to_dict() for each in found.advice], "tried": found.tried})
    click.echo(f"{found.sentence}.", err=True)
    click.echo(advice_text(found.advice), err=True, nl=bool(found.advice))
    return EXIT_INPUT


def _explained(outcome: Outcome) -> str:
    """Return the table of limits of a run: of its refusal, or of its plan."""
    from pentapod.cli.limits_text import limits_text, shortfalls_text
    from pentapod.job.outcome import SetUps
    from pentapod.planning import PlacedPath
    from pentapod.planning.diagnosis import active_limits

    if (setups := outcome.find(SetUps)) is not None:
        return "\n\n".join(f"{part.folder}\n{_explained(part.outcome)}" for part in setups.parts)
    if outcome.refusal is not None and outcome.refusal.diagnosis:
        return shortfalls_text(outcome.refusal)
    placed = outcome.find(PlacedPath)
    return "" if placed is None else limits_text(active_limits(placed))
