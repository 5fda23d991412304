"""pentapod simulate: what a real machine would make of a program."""

# ruff: noqa: PLC0415 - a verb loads what it needs when it runs, so that --help stays quick

from __future__ import annotations

from pathlib import Path

import click

from pentapod.cli.output import echo_json, json_option, progress_bar, quiet_option


@click.command()
@click.argument("program", type=click.Path(path_type=Path))
@click.option("--job", required=True, type=click.Path(path_type=Path), help="The job it was made from.")
@click.option("--engine", type=click.Choice(["servo"]), default="servo", show_default=True,
              help="servo: drives with encoders, dead time and force ripple.")  # fmt: skip
@click.option("--correct", is_flag=True, help="Servo: correct the legs by the pose, rebuilt in the loop.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Servo: of the ripple's phases.")
@click.option("--within", "within_mm", type=click.FloatRange(0.0, min_open=True), metavar="MM",
              help="Fail where the tip leaves the programmed path by more.")  # fmt: skip
@json_option
@quiet_option
def simulate(
    program: Path,
    job: Path,
    engine: str,
    correct: bool,
    seed: int,
    within_mm: float | None,
    as_json: bool,
    quiet: bool,
) -> int:
    """Play PROGRAM.csv on a simulated machine and measure how far the tool is off.

    The drives are those of the machine file's table [drives]; docs/simulation.md says what is modelled.
    """
    from pentapod.job import Job
    from pentapod.pipeline import job_machine, job_mesh, job_toolpath
    from pentapod.program import read_csv
    from pentapod.program.posts import PostInput
    from pentapod.refusal import Refusal
    from pentapod.simulate import Reference, Tracking, simulate_servo

    read, loaded = read_csv(program), Job.load(job)
    machine = PostInput(read, job_machine(loaded)).the_machine()
    reference = Reference(read, machine)
    with progress_bar(quiet=quiet or as_json) as progress:
        progress("toolpath", 0.0)
        toolpath, _ = job_toolpath(loaded, job_mesh(loaded, progress), progress)
        progress("simulate", 0.0)
        played = simulate_servo(reference, seed=seed, correct=correct)
        progress("simulate", 1.0)
    if isinstance(played, Refusal):
        if as_json:
            echo_json({"engine": engine, "done": False, "cause": str(played)})
        click.echo(f"refused: {played}", err=True)
        return 1
    tracking = Tracking(played, reference, toolpath, loaded.tolerance.path_mm * 1e-3)
    passed = within_mm is None or tracking.measures[0].largest <= within_mm
    if as_json:
        settings = {"engine": engine, "seed": seed, "correct": correct, "rows": len(read.legs)}
        echo_json({**settings, "done": True, "passed": passed, **tracking.to_dict()})
    elif not quiet:
        click.echo(f"{engine}: {len(read.legs)} setpoints, {read.duration:.6g} s, seed {seed}"
                   + (", corrected by the pose" if correct else ""))  # fmt: skip
        click.echo("\n".join(tracking.lines()))
    if not passed:
        click.echo(f"the contour error exceeds {within_mm:g} mm", err=True)
    return 0 if passed else 1
