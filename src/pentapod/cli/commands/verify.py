"""pentapod verify: verify a program file against its job."""

# ruff: noqa: PLC0415 - a verb loads what it needs when it runs, so that --help stays quick

from __future__ import annotations

from pathlib import Path

import click

from pentapod.cli.output import echo_json, json_option, note_changes, progress_bar, quiet_option, verdict_text


@click.command()
@click.argument("program", type=click.Path(path_type=Path))
@click.option("--job", required=True, type=click.Path(path_type=Path), help="The job it was made from.")
@click.option("--strict", is_flag=True, help="List also the claims that do not apply, with the reason.")
@json_option
@quiet_option
def verify(program: Path, job: Path, strict: bool, as_json: bool, quiet: bool) -> int:
    """Judge PROGRAM against its job, from the file alone: a program.csv, or the folder of a run.

    Nothing of the planner is used: the rows are replayed through the closed-form forward kinematics and compared with
    what the job asks for. Of a job in several set-ups name the folder: only there it shows that they make every cut.
    What cannot be judged is listed and fails, unless the job waives it ([verify] waive).
    """
    from pentapod.job.schema.job import Job
    from pentapod.job.verdict import judge

    note_changes(program.parent)
    loaded = Job.load(job)
    with progress_bar(quiet=quiet or as_json) as progress:
        verdict = judge(loaded, program, progress, strict=strict)
    if as_json:
        echo_json(verdict.to_dict())
    elif not quiet:
        click.echo(verdict_text(verdict))
    return 0 if verdict.passed else 1
