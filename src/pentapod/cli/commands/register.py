"""pentapod register: where the clamped part is, from touches of a probe; and which touches to make."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pentapod.cli.numbers import Real, Whole
from pentapod.cli.output import echo_json, json_option, quiet_option
from pentapod.cli.progress import progress_bar

if TYPE_CHECKING:
    from pentapod.job.clamped.registration import FoundPart

FIT = "fit"


class _Group(click.Group):
    """A group whose first argument may be a file: then it is the command `fit`."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that the first argument names, or `fit`."""
        if args[0] not in self.commands and not args[0].startswith("-"):
            args = [FIT, *args]
        return super().resolve_command(ctx, args)


@click.group(cls=_Group)
def register() -> None:
    """Find the clamped part: `pentapod register TOUCHES.csv --job JOB.toml`, short for `register fit`."""


@register.command(FIT)
@click.argument("touches", type=click.Path(path_type=Path))
@click.option("--job", required=True, type=click.Path(path_type=Path), help="The job of the part.")
@click.option("-o", "--out", type=click.Path(path_type=Path), default=Path("found.toml"), show_default=True,
              help="File for the placement.")  # fmt: skip
@click.option("--near", type=click.Path(path_type=Path), metavar="DIR|FILE",
              help="Planned placement: a run's folder or a placement file; else that in TOUCHES.")  # fmt: skip
@click.option("--noise", "noise_um", type=Real(0.0, min_open=True), metavar="UM",
              help="Standard deviation of a touch, micrometres; else it is estimated from the residuals.")  # fmt: skip
@click.option("--hold", is_flag=True, help="Motions that the touches do not determine stay as planned.")
@click.option("--within", "within_mm", type=Real(0.0, min_open=True), metavar="MM",
              help="Fail if the cut surface is known less well along its normals (95 %).")  # fmt: skip
@json_option
@quiet_option
def fit(
    touches: Path, job: Path, out: Path, *, within_mm: float | None, as_json: bool, quiet: bool, **given: Any
) -> int:
    """Find the part from TOUCHES.csv: the leg lengths at each touch of the probe.

    Writes the placement as a table [placement] for a job, or for --placement of `plan` and `replan`. Prints the
    residual of each touch, how well the cut surface is known, and touches that do not fit. If the touches do not
    determine the placement, or less well than --within asks, the exit code is 1 and no file is written; the message
    names the motion, and further touches.
    """
    from pentapod.base.files import atomic_write
    from pentapod.base.units import from_si, to_si
    from pentapod.job.clamped.registration import register_part
    from pentapod.job.schema.job import Job

    noise = to_si(given["noise_um"], "um")
    with progress_bar(quiet=quiet or as_json) as progress:
        found = register_part(
            Job.load(job), touches, near=given["near"], noise=noise, hold=given["hold"], progress=progress
        )
    refused = None if found.refused is None else str(found.refused)
    if refused is None and within_mm is not None and found.registration.uncertainty > to_si(within_mm, "mm"):
        known = f"{from_si(found.registration.uncertainty, 'mm'):.3g} mm"
        refused = f"the cut surface is known to {known} along its normals, --within asks for {within_mm:g} mm"
    if refused is None:
        with atomic_write(out) as temporary:
            temporary.write_text(found.toml(), encoding="utf-8")
    if as_json:
        answer = {"registered": refused is None, "refusal": refused, "out": str(out) if refused is None else None}
        echo_json({**_content(found), **answer})
    elif not quiet:
        click.echo(_text(found, within_mm))
        if refused is None:
            click.echo(f"wrote {out}")
    if refused is not None:
        click.echo(f"refused: {refused}", err=True)
    return 0 if refused is None else 1


_TOUCHES = "touches.csv"
_SIZE = Real(0.0, min_open=True)


@register.command("plan")
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@click.option("-o", "--out", type=click.Path(path_type=Path), default=Path("probing"), show_default=True,
              help="Folder for the files.")  # fmt: skip
@click.option("-n", "count", type=Whole(7, 1000), default=40, show_default=True, help="How many touches.")
@click.option("--probe-length", "length_mm", type=_SIZE, metavar="MM",
              help="From the platform's origin to the end of the tip; else the job's tool length.")  # fmt: skip
@click.option("--tip-diameter", "tip_mm", type=_SIZE, default=4.0, show_default=True, metavar="MM",
              help="Of the probe's ball.")  # fmt: skip
@click.option("--stylus", "stylus_mm", type=_SIZE, default=40.0, show_default=True, metavar="MM",
              help="Free length of the stylus; it is half as thick as the ball.")  # fmt: skip
@click.option("--body-diameter", "body_mm", type=_SIZE, default=25.0, show_default=True, metavar="MM",
              help="Of the probe's body above the stylus.")  # fmt: skip
@click.option("--misplaced", "misplaced_mm", type=_SIZE, default=3.0, show_default=True, metavar="MM",
              help="How far the part may be from its place: touches stay so far from edges.")  # fmt: skip
@json_option
@quiet_option
def plan(folder: Path, out: Path, count: int, *, as_json: bool, quiet: bool, **given: Any) -> int:
    """Choose touches for the part of the run in DIR, and write the program that makes them.

    The touches tell most about the place of the cut surface. The way to each is clear of part and fixture, and within
    the machine's limits. Writes probing.ngc (G38.2 of LinuxCNC with the legs as axes), touches.csv, to which that
    program adds the legs at each trip, and expected.csv: the touches if the part stands as planned, to rehearse
    `register`.
    """
    from pentapod.base.errors import InputError
    from pentapod.base.files import atomic_write
    from pentapod.base.refusal import Refusal
    from pentapod.base.units import to_si
    from pentapod.job.clamped.probing import Probe, probing_of
    from pentapod.registration.touches import has_touches, touches_text

    if has_touches(out / _TOUCHES):
        raise InputError(
            "holds touches, which would be lost", file=out / _TOUCHES,
            remedy="choose another folder with -o, or move this file away",
        )  # fmt: skip
    tip = 0.5 * float(to_si(given["tip_mm"], "mm"))
    probe = Probe(
        to_si(given["length_mm"], "mm"), tip, to_si(given["stylus_mm"], "mm"), 0.5 * tip,
        body_radius=0.5 * float(to_si(given["body_mm"], "mm")),
    )  # fmt: skip
    found = probing_of(folder, probe, count, float(to_si(given["misplaced_mm"], "mm")))
    if isinstance(found, Refusal):
        if as_json:
            echo_json({"planned": False, "refusal": str(found)})
        click.echo(f"refused: {found}", err=True)
        return 1
    out.mkdir(parents=True, exist_ok=True)
    files = {
        "probing.ngc": found.gcode(_TOUCHES),
        _TOUCHES: touches_text(found.head),
        "expected.csv": touches_text(found.expected),
    }
    for name, text in files.items():
        with atomic_write(out / name) as temporary:
            temporary.write_text(text, encoding="utf-8")
    if as_json:
        echo_json({"planned": True, "touches": len(found.legs), "files": [str(out / name) for name in files]})
    elif not quiet:
        click.echo(f"{len(found.legs)} touches; wrote {', '.join(str(out / name) for name in files)}")
    return 0


def _text(found: FoundPart, within_mm: float | None) -> str:
    from pentapod.base.units import from_si, to_si
    from pentapod.job.clamped.registration import touch_names
    from pentapod.report.words import placement_sentences

    def um(value: float) -> str:
        return f"{from_si(value, 'um'):.2f} um"

    result = found.registration
    wanted = f"tolerance.path_mm = {found.job.tolerance.path_mm:g}" if within_mm is None else f"{within_mm:g} mm"
    tolerance = found.job.tolerance.si.path if within_mm is None else to_si(within_mm, "mm")
    lines = [
        f"{int(result.used.sum())} of {len(result.used)} touches used; residuals {um(result.rms)} rms, "
        f"{um(float(abs(result.residuals[result.used]).max(initial=0.0)))} at most; standard deviation of a touch "
        f"{um(result.noise)}",
        f"the cut surface is known to {um(result.uncertainty)} along its normals where it is worst (95 %)",
        *(f"  outlier: {name}, not used" for name in found.outlier_names),
        *(
            f"  not determined: {motion.name}; it moves the cut surface across by {motion.across:.2g} mm for each mm"
            for motion in result.held
        ),
        *(f"  also fits: {other}" for other in result.others),
    ]
    if result.uncertainty > tolerance and found.refused is None:
        lines.append(f"  that is more than {wanted}: touch more, first at")
        lines += [f"    {name}" for name in touch_names(*found.proposals)]
    return "\n".join([*lines, *placement_sentences(result.placement)])


def _content(found: FoundPart) -> dict[str, Any]:
    from pentapod.base.units import from_si
    from pentapod.job.plan_arrays import matrix_mm

    result = found.registration
    return {
        "placement_mm": matrix_mm(result.placement).tolist(),
        "residuals_um": from_si(result.residuals, "um").round(3).tolist(),
        "outlier_lines": [found.touches.lines[k] for k in result.outliers],
        "noise_um": from_si(result.noise, "um"),
        "uncertainty_um": from_si(result.uncertainty, "um"),
        "undetermined": [{"motion": motion.name, "across": motion.across} for motion in result.held],
        "others": [str(other) for other in result.others],
        "touch_next_mm": from_si(found.proposals[0], "mm").round(3).tolist(),
    }
