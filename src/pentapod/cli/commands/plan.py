"""pentapod plan: plan a job and write its files."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pentapod.cli.output import advice_text, cores_option, echo_json, json_option, quiet_option, verdict_text
from pentapod.cli.progress import progress_bar

if TYPE_CHECKING:
    from pentapod.job.advice.options import AdviceOptions
    from pentapod.job.outcome import Outcome
    from pentapod.job.schema.job import Job


@click.command()
@click.argument("jobs", type=click.Path(path_type=Path), nargs=-1, required=True, metavar="JOB...")
@click.option("-o", "--out", type=click.Path(path_type=Path), default=Path("out"), show_default=True,
              help="Folder for the files; with several jobs for a folder of each.")  # fmt: skip
@click.option("--set", "changes", multiple=True, metavar="TABLE.KEY=VALUE",
              help="Another value of a key: --set feed.cut_mm_min=1200; writes changed-job.toml, too. "
                   "Can be repeated.")  # fmt: skip
@click.option("--explain", is_flag=True, help="Print what limits the speed and the pose: where, and by how much.")
@click.option("--advice", type=click.IntRange(0), metavar="N",
              help="How many changes to find for a job that cannot be done; 0: do not search. "
                   "1 when left out, but 0 if the error already says which unit the part must have.")  # fmt: skip
@click.option("--placement", type=click.Path(path_type=Path), metavar="FILE",
              help="Fix the part where `pentapod register` found it; writes placed-job.toml, too.")  # fmt: skip
@cores_option
@json_option
@quiet_option
def plan(
    jobs: tuple[Path, ...],
    out: Path,
    changes: tuple[str, ...],
    explain: bool,
    advice: int | None,
    placement: Path | None,
    as_json: bool,
    quiet: bool,
) -> int:
    """Plan JOB.toml: write program.csv, verdict.json, report.html, sheet.html and plan.npz.

    The folder changes only when the run ends, so that its files are always of one run. Only a program that passes its
    verdict is called program.csv; one that fails is called withheld.csv. If a job cannot be done, changes of it are
    searched for and planned, and those that pass are printed. A job in several set-ups has a folder for each: setup-1,
    setup-2, and so on.

    Several jobs are planned one after the other, each into a folder of its name in OUT. If one of them cannot be done,
    the others are still planned. The exit code is the largest one. `pentapod batch` uses all cores, and goes on after
    an interruption.

    Ctrl-C during the search for a placement ends the search, and the best placement so far is used if it fits. During
    the search for changes it ends that search. At any other time it ends the command and changes nothing.
    """
    asked = Asked(out, changes, explain, advice, placement, as_json, quiet)
    if len(jobs) == 1:
        code, content = _planned(jobs[0], asked)
    else:
        code, content = _each(jobs, asked)
    if as_json and content is not None:
        echo_json(content)
    return code


@dataclasses.dataclass(frozen=True)
class Asked:
    """The options of a command."""

    out: Path
    changes: tuple[str, ...]
    explain: bool
    advice: int | None
    placement: Path | None
    as_json: bool
    quiet: bool


def _each(jobs: tuple[Path, ...], asked: Asked) -> tuple[int, Any]:
    """Plan jobs one after the other; return the largest exit code and what JSON says of each."""
    from pentapod.base.errors import InputError

    if asked.placement is not None:
        raise InputError("a placement is of one job", key="--placement", value=f"{len(jobs)} jobs", expected="one job")
    names = [path.stem for path in jobs]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError("two jobs of one name", value=twice[0], expected="names that differ, for their folders")
    codes: list[int] = []
    contents: list[Any] = []
    for path in jobs:
        if not (asked.as_json or asked.quiet):
            click.echo(f"== {path}")
        try:
            code, content = _planned(path, dataclasses.replace(asked, out=asked.out / path.stem))
        except InputError as error:
            from pentapod.cli.main import EXIT_INPUT

            click.echo(f"error: {error}", err=True)
            code, content = EXIT_INPUT, {"error": str(error)}
        codes.append(code)
        contents.append({"job": str(path), "exit_code": code, **(content or {})})
    if not (asked.as_json or asked.quiet):
        passed = codes.count(0)
        click.echo(f"{len(jobs)} jobs: {passed} passed, {len(jobs) - passed} did not")
    return max(codes), contents


def _planned(path: Path, asked: Asked) -> tuple[int, dict[str, Any] | None]:
    """Plan one job and print what became of it; return the exit code, and what JSON says."""
    from pentapod.base.errors import InputError
    from pentapod.cli.changes import CHANGED_JOB, changed, withdraw, written_before
    from pentapod.job.schema.job import Job

    before = written_before(asked.out)
    job = changed(Job.load(path), asked.changes, asked.out)

    from pentapod.job.advice.options import AdviceOptions
    from pentapod.job.artefacts import REPORT, SHEET
    from pentapod.job.pipeline.advice_on_errors import can_help
    from pentapod.job.pipeline.run import run

    options = None if asked.advice == 0 else AdviceOptions(wanted=asked.advice or 1)
    if asked.placement is not None:
        from pentapod.job.clamped.placed_job import placed_job, read_placement

        job = placed_job(job, read_placement(asked.placement), asked.out)
    try:
        with progress_bar(quiet=asked.quiet or asked.as_json) as progress:
            outcome = run(
                job, asked.out, progress, writers={REPORT: _write_report, SHEET: _write_sheet}, advice=options
            )
    except InputError as error:
        withdraw(asked.out, before)
        if options is None or not can_help(error) or (asked.advice is None and error.key == "part.unit"):
            raise
        click.echo(f"error: {error}", err=True)  # at once: the search takes as long as a plan or two
        return _advised(job, options, as_json=asked.as_json, quiet=asked.quiet)
    of_before = asked.out / CHANGED_JOB
    if not asked.changes and of_before.is_file() and not of_before.samefile(path):
        of_before.unlink()
    return shown(outcome, asked.out, explain=asked.explain, as_json=asked.as_json, quiet=asked.quiet)


def shown(
    outcome: Outcome, out: Path, *, explain: bool, as_json: bool, quiet: bool
) -> tuple[int, dict[str, Any] | None]:
    """Print the outcome of a run in a folder, as text; return the exit code, and what JSON says."""
    from pentapod.job.artefacts import PROGRAM, REPORT, SHEET
    from pentapod.job.build.toolpath import Reports, machined_share
    from pentapod.job.outcome import SetUps
    from pentapod.job.ways.names import FILES as WAYS
    from pentapod.planning import PlacedPath
    from pentapod.planning.diagnosis import active_limits
    from pentapod.timing import Explanation

    refusal, content = outcome.refusal, None
    if as_json:
        seconds = {stage.name: round(stage.seconds, 3) for stage in outcome.stages}
        story = outcome.find(Explanation)
        more: dict[str, Any] = {} if story is None else {"timing": story.to_dict()}
        if explain and (placed := outcome.find(PlacedPath)) is not None:
            more["limits"] = [dataclasses.asdict(limit) for limit in active_limits(placed)]
        content = {**outcome.to_dict(), **more, "out": str(out), "seconds": seconds}
    elif not quiet:
        click.echo("\n".join(stage.remark for stage in outcome.stages if stage.remark))
        if explain:
            click.echo(_explained(outcome))
        if refusal is None:
            click.echo(verdict_text(outcome.verdict))
            if (reports := outcome.find(Reports)) is not None and (machined := machined_share(reports)) < 1.0:
                click.echo(f"machined: {100.0 * machined:.3g} % of the surface, the region of the job")
            setups = outcome.find(SetUps)
            folders = [out] if setups is None else [out / part.folder for part in setups.parts]
            click.echo("\n".join(f"program: {folder / PROGRAM}" for folder in folders))
            ways = [str(folder / name) for folder in folders for name in WAYS.values() if (folder / name).is_file()]
            if ways:
                click.echo(f"from the park pose and back: {', '.join(ways)}")
        click.echo(f"report: {out / REPORT}")
        if refusal is None:
            click.echo(f"set-up sheet: {out / SHEET}")
    if refusal is not None:
        click.echo(f"refused: {refusal}", err=True)
        click.echo(advice_text(refusal.advice), err=True, nl=bool(refusal.advice))
    elif not outcome.passed and quiet:
        click.echo("the verdict failed", err=True)
    return (0 if outcome.passed else 1), content


def _write_report(outcome: Outcome, file: Path) -> None:
    from pentapod.report import write_report

    write_report(outcome, file)


def _write_sheet(outcome: Outcome, file: Path) -> None:
    from pentapod.report.sheet import write_sheet

    write_sheet(outcome, file)


def _advised(job: Job, options: AdviceOptions, *, as_json: bool, quiet: bool) -> tuple[int, dict[str, Any] | None]:
    """Search for advice for a job that is an error, print it; return the error's exit code, and what JSON says."""
    from pentapod.base.errors import InputError
    from pentapod.cli.main import EXIT_INPUT
    from pentapod.job.pipeline.advice_on_errors import advise

    try:
        with progress_bar(quiet=quiet or as_json) as progress:
            found = advise(job, options=options, progress=progress)
    except InputError:  # the one that was printed: nothing can be tried before it is mended
        return EXIT_INPUT, None
    click.echo(f"{found.sentence}.", err=True)
    click.echo(advice_text(found.advice), err=True, nl=bool(found.advice))
    return EXIT_INPUT, {"advice": [each.to_dict() for each in found.advice], "tried": found.tried}


def _explained(outcome: Outcome) -> str:
    """Return the table of limits of a run: of its refusal, or of its plan."""
    from pentapod.cli.limits_text import limits_text, shortfalls_text
    from pentapod.job.outcome import SetUps
    from pentapod.planning import PlacedPath
    from pentapod.planning.diagnosis import active_limits
    from pentapod.timing import Explanation

    if (setups := outcome.find(SetUps)) is not None:
        return "\n\n".join(f"{part.folder}\n{_explained(part.outcome)}" for part in setups.parts)
    if outcome.refusal is not None and outcome.refusal.diagnosis:
        return shortfalls_text(outcome.refusal)
    placed, story = outcome.find(PlacedPath), outcome.find(Explanation)
    tables = [] if story is None else [f"limits on the speed, the most costly first\n{story.details()}"]
    return "\n".join(tables if placed is None else [*tables, limits_text(active_limits(placed))])
