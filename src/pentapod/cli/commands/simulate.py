"""pentapod simulate: tracking errors of a program on a simulated machine."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pentapod.cli.numbers import Real, Whole
from pentapod.cli.output import HtmlFile, echo_json, json_option, quiet_option
from pentapod.cli.progress import progress_bar

if TYPE_CHECKING:
    from pentapod.base.progress import Progress
    from pentapod.base.refusal import Refusal
    from pentapod.simulate import Physics, Reference, Tracking
    from pentapod.toolpath import Toolpath

SERVO_OPTIONS, MUJOCO_OPTIONS = ("correct", "seed"), ("export", "cutting_force_n", "base_error", "offset_error")
_LEG, _MM = Whole(1), Real()


@click.command()
@click.argument("program", type=click.Path(path_type=Path))
@click.option("--job", required=True, type=click.Path(path_type=Path), help="The job of the program.")
@click.option("--engine", type=click.Choice(["servo", "mujoco"]), default="servo", show_default=True,
              help="servo: drives with encoders, dead time and force ripple. mujoco: rigid bodies.")  # fmt: skip
@click.option("--correct", is_flag=True, help="Servo: correct the legs by the pose from forward kinematics.")
@click.option(
    "--seed", type=Whole(0), default=0, show_default=True, help="Servo: seed of the phases of the force ripple."
)
@click.option("--export", type=click.Path(path_type=Path), metavar="FILE", help="MuJoCo: write the model as MJCF.")
@click.option("--cutting-force", "cutting_force_n", type=Real(0.0, min_open=True), metavar="N",
              help="MuJoCo: simulate again with this force on the tip against its motion on cuts.")  # fmt: skip
@click.option("--base-error", type=(_LEG, _MM, _MM, _MM), multiple=True, metavar="LEG X Y Z",
              help="MuJoCo: error of a base joint; may be repeated.")  # fmt: skip
@click.option("--offset-error", type=(_LEG, _MM), multiple=True, metavar="LEG MM",
              help="MuJoCo: error of a platform joint along the tool; may be repeated.")  # fmt: skip
@click.option("--within", "within_mm", type=Real(0.0, min_open=True), metavar="MM",
              help="Fail if the contour error is larger.")  # fmt: skip
@click.option("--plots", "plots", type=HtmlFile(), metavar="FILE.html",
              help="Write an HTML page with all measures against time.")  # fmt: skip
@json_option
@quiet_option
@click.pass_context
def simulate(ctx: click.Context, program: Path, job: Path, as_json: bool, quiet: bool, **given: Any) -> int:
    """Simulate PROGRAM.csv on a machine and measure the errors of the tool.

    Drives and masses are [drives] and [masses] of the machine file; docs/simulation.md describes the models.
    """
    from pentapod.base.refusal import Refusal
    from pentapod.job.build.pieces import program_toolpath
    from pentapod.job.build.values import job_machine, job_mesh
    from pentapod.job.schema.job import Job
    from pentapod.program import read_csv
    from pentapod.program.commands import read_back
    from pentapod.program.posts import PostInput
    from pentapod.simulate import Reference, load_mujoco

    engine, within_mm, plots = given["engine"], given["within_mm"], given.pop("plots")
    _check_options(ctx, engine)
    if engine == "mujoco":
        load_mujoco()  # fails at once where it is not installed
    read, loaded = read_csv(program), Job.load(job)
    machine = PostInput(read, job_machine(loaded)).the_machine()
    reference = Reference(read_back(read, machine), machine)
    same_job = read.provenance.job_digest == loaded.digest
    with progress_bar(quiet=quiet or as_json) as progress:
        progress("toolpath", 0.0)
        toolpath = program_toolpath(loaded, job_mesh(loaded, progress), program, progress)
        task = _Task(reference, toolpath, loaded.tolerance.path_mm * 1e-3, progress)
        found = task.servo(**given) if engine == "servo" else task.mujoco(**given)
    if isinstance(found, Refusal):
        if as_json:
            echo_json({"engine": engine, "done": False, "cause": str(found)})
        click.echo(f"refused: {found}", err=True)
        return 1
    lines, content, tracking = found
    whole = f"{len(read.legs)} setpoints, {read.duration:.6g} s; job {job}, machine {reference.machine.name}"
    if plots is not None:
        from pentapod.report import write_simulation

        names = ("as programmed", f"with {given['cutting_force_n']} N on cuts")
        write_simulation(plots, program.name, engine, [whole, *lines], list(zip(names, tracking, strict=False)))
        lines, content = [*lines, f"  plots: {plots}"], {**content, "plots": str(plots)}
    largest = max(part.measures[0].largest for part in tracking)
    passed = within_mm is None or largest <= within_mm
    if as_json:
        echo_json(
            {"engine": engine, "rows": len(read.legs), "same_job": same_job, "done": True, "passed": passed, **content}
        )
    elif not quiet:
        click.echo("\n".join([f"{engine}: {whole}", *lines]))
    if not same_job and not quiet:
        click.echo("note: the program was made from another job; its toolpath may differ", err=True)
    if not passed:
        click.echo(f"the contour error, {largest:.3g} mm, exceeds {within_mm:g} mm", err=True)
    return 0 if passed else 1


def _check_options(ctx: click.Context, engine: str) -> None:
    """Raise UsageError for an option of the other engine."""
    for name in MUJOCO_OPTIONS if engine == "servo" else SERVO_OPTIONS:
        if ctx.get_parameter_source(name) == click.core.ParameterSource.COMMANDLINE:
            other = "mujoco" if engine == "servo" else "servo"
            option = name.removesuffix("_n").replace("_", "-")
            raise click.UsageError(f"--{option} needs --engine {other}", ctx)


_Found = tuple[list[str], dict[str, Any], tuple["Tracking", ...]]


@dataclass(frozen=True)
class _Task:
    """A program, its machine and its toolpath; each engine returns text, JSON and measures."""

    reference: Reference
    toolpath: Toolpath
    tolerance: float
    progress: Progress

    def servo(self, *, seed: int, correct: bool, **_: Any) -> _Found | Refusal:
        from pentapod.base.refusal import Refusal
        from pentapod.simulate import Tracking, simulate_servo

        self.progress("simulate", 0.0)
        played = simulate_servo(self.reference, seed=seed, correct=correct)
        if isinstance(played, Refusal):
            return played
        tracking = Tracking(played, self.reference, self.toolpath, self.tolerance)
        lines = [f"  seed {seed}, " + ("corrected by the pose" if correct else "not corrected"), *tracking.lines()]
        return lines, {"seed": seed, "correct": correct, **tracking.to_dict()}, (tracking,)

    def mujoco(self, *, export: Path | None, cutting_force_n: float | None, **given: Any) -> _Found | Refusal:
        from pentapod.base.files import atomic_write
        from pentapod.base.refusal import Refusal
        from pentapod.simulate import cutting_forces, plant, simulate_mujoco

        errors = _errors(given["base_error"], given["offset_error"], self.reference.machine.robot.n_legs)
        modelled = plant(self.reference, **errors)
        if isinstance(modelled, Refusal):
            return modelled
        if export is not None:
            with atomic_write(export) as temporary:
                temporary.write_text(modelled.xml, encoding="utf-8")
        free = simulate_mujoco(self.reference, modelled, progress=self.progress)
        if isinstance(free, Refusal):
            return free
        tracking, lines, content = self._measured(free)
        if export is not None:
            lines, content = [*lines, f"  model: {export}"], {**content, "model": str(export)}
        if cutting_force_n is None:
            return lines, content, (tracking,)
        forces = cutting_forces(self.reference, tracking.cutting, cutting_force_n)
        loaded = simulate_mujoco(self.reference, modelled, tip_forces=forces, progress=self.progress)
        if isinstance(loaded, Refusal):
            return loaded
        second, more, inner = self._measured(loaded)
        lines = [*lines, f"with {cutting_force_n:g} N against the motion on cuts", *more]
        return lines, {**content, "cutting": {"force_n": cutting_force_n, **inner}}, (tracking, second)

    def _measured(self, physics: Physics) -> tuple[Tracking, list[str], dict[str, Any]]:
        from pentapod.simulate import Tracking

        tracking = Tracking(physics.played, self.reference, self.toolpath, self.tolerance, physics.measures)
        low, high = physics.leg_forces.min(axis=0), physics.leg_forces.max(axis=0)
        spans = ", ".join(f"{a:.1f} to {b:.1f}" for a, b in zip(low, high, strict=True))
        lines = [*tracking.lines(), f"  leg forces 1 to {len(low)}, pushing: {spans} N"]
        return tracking, lines, {**tracking.to_dict(), "leg_forces_n": {"least": low.tolist(), "most": high.tolist()}}


def _errors(
    base: list[tuple[int, float, float, float]], offset: list[tuple[int, float]], n_legs: int
) -> dict[str, Any]:
    """Return the errors of the options, millimetres, as arrays in metres. Raises InputError: no such leg."""
    import numpy as np

    from pentapod.base.errors import InputError

    last = max((leg for leg, *_ in (*base, *offset)), default=1)
    if last > n_legs:
        raise InputError("no such leg", key="--base-error, --offset-error", value=last, expected=f"1 to {n_legs}")
    base_errors, offset_errors = np.zeros((n_legs, 3)), np.zeros(n_legs)
    for leg, *error in base:
        base_errors[leg - 1] += np.array(error) * 1e-3
    for leg, along in offset:
        offset_errors[leg - 1] += along * 1e-3
    return {"base_errors": base_errors, "offset_errors": offset_errors}
