"""pentapod plan: plan a job and write its files."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pentapod.cli.output import echo_json, json_option, progress_bar, quiet_option, verdict_text

if TYPE_CHECKING:
    from pentapod.job.outcome import Outcome


@click.command()
@click.argument("job", type=click.Path(path_type=Path))
@click.option("-o", "--out", type=click.Path(path_type=Path), default=Path("out"), show_default=True,
              help="Folder for the files.")  # fmt: skip
@click.option("--explain", is_flag=True, help="Print the nearest limits: where, and by how much.")
@json_option
@quiet_option
def plan(job: Path, out: Path, explain: bool, as_json: bool, quiet: bool) -> int:
    """Plan JOB.toml: write program.csv, verdict.json, report.html and plan.npz.

    The folder changes only when the run ends, so that its files are always of one run. A job that cannot be done
    leaves no program.csv. A job in several set-ups has a folder of files for each: setup-1, setup-2, and so on.

    Ctrl-C during the search for a placement continues with the best one so far, if that fits. At any other time it
    ends the command and changes nothing.
    """
    from pentapod.job.artefacts import PROGRAM, REPORT
    from pentapod.job.outcome import SetUps
    from pentapod.job.pipeline import run
    from pentapod.job.schema.job import Job
    from pentapod.planning import PlacedPath
    from pentapod.planning.diagnosis import active_limits
    from pentapod.report import write_report
    from pentapod.timing import Explanation

    loaded = Job.load(job)
    with progress_bar(quiet=quiet or as_json) as progress:
        outcome = run(loaded, out, progress, writers={REPORT: write_report})
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
    elif not outcome.passed and quiet:
        click.echo("the verdict failed", err=True)
    return 0 if outcome.passed else 1


def _explained(outcome: Outcome) -> str:
    """Return the table of limits of a run: of its refusal, or of its plan."""
    from pentapod.cli.commands.explain import limits_text, shortfalls_text
    from pentapod.job.outcome import SetUps
    from pentapod.planning import PlacedPath
    from pentapod.planning.diagnosis import active_limits

    if (setups := outcome.find(SetUps)) is not None:
        return "\n\n".join(f"{part.folder}\n{_explained(part.outcome)}" for part in setups.parts)
    if outcome.refusal is not None and outcome.refusal.diagnosis:
        return shortfalls_text(outcome.refusal)
    placed = outcome.find(PlacedPath)
    return "" if placed is None else limits_text(active_limits(placed))
