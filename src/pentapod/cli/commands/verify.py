"""pentapod verify: verify a program file against its job."""

from __future__ import annotations

from pathlib import Path

import click

from pentapod.cli.output import cores_option, echo_json, json_option, note_changes, quiet_option, verdict_text
from pentapod.cli.progress import progress_bar


@click.command()
@click.argument("program", type=click.Path(path_type=Path))
@click.option("--job", required=True, type=click.Path(path_type=Path), help="The job of the program.")
@click.option("--strict", is_flag=True, help="List also the claims that do not apply, with the reason.")
@cores_option
@json_option
@quiet_option
def verify(program: Path, job: Path, strict: bool, as_json: bool, quiet: bool) -> int:
    """Judge PROGRAM against its job, from the file alone: a program.csv, or the folder of a run.

    Nothing of the planner is used: the rows are replayed through the closed-form forward kinematics and compared with
    the job. For a job in several set-ups name the folder, so that it is judged whether they make every cut. A claim
    that cannot be judged is listed and fails, unless the job waives it ([verify] waive).
    """
    from pentapod.job.artefacts import PROGRAM
    from pentapod.job.schema.job import Job
    from pentapod.job.verdict import judge
    from pentapod.program.csv import read_header

    note_changes(program.parent)
    loaded = Job.load(job)
    file = program / PROGRAM if program.is_dir() else program
    if file.is_file() and read_header(file).provenance.job_digest != loaded.digest:
        # At once: judging takes long, and longer where the path is not that of the job.
        click.echo(f"note: {program} was made from another job than {job}, or from another state of it", err=True)
    with progress_bar(quiet=quiet or as_json) as progress:
        verdict = judge(loaded, program, progress, strict=strict)
    if as_json:
        echo_json(verdict.to_dict())
    elif not quiet:
        click.echo(verdict_text(verdict))
    return 0 if verdict.passed else 1
