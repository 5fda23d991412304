"""pentapod batch, pentapod sweep: many jobs on the workers of Dask, in one folder with tables and a page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from pentapod.cli.numbers import Real, Whole
from pentapod.cli.output import echo_json, json_option, quiet_option
from pentapod.cli.silence import Silence

if TYPE_CHECKING:
    from pentapod.batch import Done
    from pentapod.batch.pace import Pace

Command = TypeVar("Command", bound=Callable[..., Any])

SHOWN = 100
"""Characters of a cause on a line of progress."""

SILENT_S = 20.0
"""Seconds without a job that is done after which a line says that the others go on."""


def _options(command: Command) -> Command:
    """Add the options of both commands."""
    for option in (
        quiet_option,
        json_option,
        click.option("--most", type=Whole(1), metavar="N", default=10_000, show_default=True,
                     help="Largest number of jobs; more are an error."),
        click.option("--parquet", is_flag=True, help="Write table.parquet, too (needs pentapod[parquet])."),
        click.option("--memory", type=Real(1.0), metavar="MB", default=4000.0, show_default=True,
                     help="Memory that one job may use; one that needs more has the result `crashed`."),
        click.option("--scheduler", metavar="ADDRESS",
                     help="Dask scheduler whose workers do the work, such as tcp://host:8786."),
        click.option("-j", "--workers", type=Whole(1), metavar="N",
                     help="Processes on this machine; one for each core if left out."),
        click.option("-o", "--out", type=click.Path(path_type=Path), default=Path("runs"), show_default=True,
                     help="Folder for the jobs' folders, the tables and the page."),
    ):  # fmt: skip
        command = option(command)
    return command


@click.command()
@click.argument("jobs", type=click.Path(path_type=Path), nargs=-1, required=True)
@_options
def batch(jobs: tuple[Path, ...], **asked: Any) -> int:
    """Plan and verify many jobs: JOB.toml ...

    Each job has a folder in OUT with the files of `plan`, by its name and the hash of all that it depends on. Jobs
    whose folders are there are not run again: the same command goes on after an interruption, or after some jobs were
    changed. table.csv and table.jsonl have a row for each job, index.html shows them with links to their reports.

    The exit code is 0 if all jobs passed.
    """
    return _run(list(jobs), **asked)


@click.command()
@click.argument("file", type=click.Path(path_type=Path), metavar="SWEEP.toml")
@_options
def sweep(file: Path, **asked: Any) -> int:
    """Plan and verify a job with many values of its keys, or of its machine's.

    SWEEP.toml names the job, and values by the path of a key: "tool.length_mm" = [190, 198] in its table [sweep]. All
    else is as in `batch`.
    """
    from pentapod.batch.sweep import Sweep

    return _run(Sweep.load(file, asked["most"]), **asked)


def _run(
    jobs: Any, *, out: Path, workers: int | None, scheduler: str | None, memory: float, parquet: bool, most: int,
    as_json: bool, quiet: bool,
) -> int:  # fmt: skip
    from pentapod.base.errors import InputError
    from pentapod.batch.pace import Pace
    from pentapod.batch.run import batch as run
    from pentapod.batch.tasks.engine import EngineOptions

    if workers is not None and scheduler is not None:
        raise InputError("--workers and --scheduler are both given", expected="one of the two")
    options = EngineOptions(memory=1e6 * memory, most=most)
    running = run(jobs, out, workers=workers, scheduler=scheduler, parquet=parquet, options=options)
    pace, counts = Pace(len(running)), Counter[str]()
    tells = not (quiet or as_json)
    if tells:
        click.echo(f"{_jobs(len(running))} in {out}; Ctrl-C keeps what is done", err=True)
    silence = Silence(lambda: click.echo(f"[{pace}] {pace.seconds:.0f} s so far", err=True), SILENT_S)
    try:
        with silence if tells else nullcontext():
            for done in running:
                pace.count(new=done.new)
                counts[done.status] += 1
                if done.new and tells:
                    click.echo(_line(done, pace), err=True)
                    silence.heard()
    except (KeyboardInterrupt, SystemExit):
        click.echo(f"{pace}; what is done is in {out}: the same command goes on from there", err=True)
        raise
    finally:
        running.close()
    return _shown(counts, out, as_json=as_json, quiet=quiet)


def _jobs(count: int) -> str:
    return f"{count} job{'' if count == 1 else 's'}"


def _line(done: Done, pace: Pace) -> str:
    """Return a line about a job that was run."""
    changed = [f"{key} = {value}" for key, value in done.task.known.items() if key != "job"]
    what = f" ({', '.join(changed)})" if changed else ""
    cause = str(done.row.get("cause") or "")
    why = f": {cause if len(cause) <= SHOWN else cause[: SHOWN - 1] + '…'}" if cause else ""
    return f"[{pace}] {done.task.name}{what}: {done.status}{why}, {done.seconds:.1f} s"


def _shown(counts: Counter[str], out: Path, *, as_json: bool, quiet: bool) -> int:
    """Print the counts of results and return the exit code."""
    from pentapod.batch.jobs import STATUSES
    from pentapod.batch.page import PAGE
    from pentapod.batch.table import CSV, LINES

    files = {"page": str(out / PAGE), "csv": str(out / CSV), "lines": str(out / LINES)}
    if as_json:
        echo_json({"results": {name: counts[name] for name in STATUSES}, **files})
    elif not quiet:
        click.echo(", ".join(f"{counts[name]} {name}" for name in STATUSES if counts[name]))
        click.echo("\n".join(f"{name}: {path}" for name, path in files.items()))
    return 0 if set(counts) <= {"passed"} else 1
