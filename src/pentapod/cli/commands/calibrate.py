"""pentapod calibrate: which poses to measure, and a machine's geometry from what was measured."""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pentapod.cli.numbers import Real, Whole
from pentapod.cli.output import HtmlFile, echo_json, json_option, quiet_option
from pentapod.cli.progress import progress_bar

if TYPE_CHECKING:
    from pentapod.machine import Machine
    from pentapod.machine.identification.measurements import Measurements

GROUPS = ("base", "offsets", "zeros", "radii")
_MM, _POSITIVE = Real(), Real(0.0, min_open=True)


@click.group()
def calibrate() -> None:
    """Choose poses to measure, and find a machine's geometry from what was measured."""


@calibrate.command("plan")
@click.argument("machine")
@click.option("-n", "--poses", "count", type=Whole(2), default=20, show_default=True, help="How many poses.")
@click.option("-o", "--out", type=click.Path(path_type=Path), default=Path("calibration"), show_default=True,
              help="Folder for program.csv, verdict.json and measurements.csv.")  # fmt: skip
@click.option("--instrument", type=click.Choice(["pose", "tracker", "ballbar"]), default="pose", show_default=True,
              help="What is measured: position and axis, position alone, or distance from a fixed ball.")  # fmt: skip
@click.option("--target", type=_MM, metavar="MM",
              help="The point that is seen, along the tool from the line's origin  [default: the tip]")  # fmt: skip
@click.option("--ball", type=(_MM, _MM, _MM), metavar="X Y Z", help="Ball bar: centre of the fixed ball.")
@click.option("--bar", type=(_POSITIVE, _POSITIVE), metavar="FROM TO", help="Ball bar: shortest and longest distance.")
@click.option("--leg-sigma", type=_POSITIVE, default=0.002, show_default=True, metavar="MM",
              help="Standard deviation of a leg's reading.")  # fmt: skip
@click.option("--position-sigma", type=_POSITIVE, default=0.01, show_default=True, metavar="MM",
              help="Of each measured coordinate, or of a distance.")  # fmt: skip
@click.option("--direction-sigma", type=_POSITIVE, default=0.001, show_default=True, metavar="DEG",
              help="Of a measured axis.")  # fmt: skip
@click.option("-c", "--component", help="Component of all poses  [default: that of the work volume]")
@click.option("--dwell", type=Real(0.0), default=5.0, show_default=True, metavar="S", help="Rest in each pose.")
@click.option("--seed", type=Whole(0), default=0, show_default=True, help="Of the poses to choose from.")
@json_option
@quiet_option
def plan_poses(
    machine: str,
    count: int,
    out: Path,
    instrument: str,
    target: float | None,
    ball: tuple[float, float, float] | None,
    bar: tuple[float, float] | None,
    leg_sigma: float,
    position_sigma: float,
    direction_sigma: float,
    component: str | None,
    dwell: float,
    seed: int,
    as_json: bool,
    quiet: bool,
) -> int:
    """Choose poses in which to measure MACHINE, and write the program that moves it there.

    Chooses the poses of the work volume that tell most about the tip. Nothing but the instrument's target may be in the
    work volume: the program knows no part and no fixture. Write what the instrument sees into measurements.csv.
    """
    from pentapod.base.refusal import Refusal
    from pentapod.base.units import from_si, to_si
    from pentapod.job.measuring.candidates import Instruments
    from pentapod.job.measuring.measuring import MEASUREMENTS, MeasuringOptions, plan_measuring
    from pentapod.kinematics import Component
    from pentapod.machine import Machine
    from pentapod.machine.identification.measurements import Instrument

    instruments = Instruments(
        Instrument(instrument),
        None if target is None else to_si(target, "mm"),
        to_si(leg_sigma, "mm"),
        to_si(position_sigma, "mm"),
        to_si(direction_sigma, "deg"),
        None if ball is None else tuple(to_si(ball, "mm").tolist()),
        *([] if bar is None else [tuple(to_si(bar, "mm").tolist())]),
    )
    branch = None if component is None else Component.parse(component)
    with progress_bar(quiet=quiet or as_json) as progress:
        found = plan_measuring(
            Machine.load(machine), out, count, instruments, component=branch, seed=seed,
            options=MeasuringOptions(dwell=dwell), progress=progress,
        )  # fmt: skip
    if isinstance(found, Refusal):
        click.echo(str(found), err=True)
        return 1
    expected, chance = (float(from_si(value, "um")) for value in (found.tip_sigma, found.random_tip_sigma))
    if as_json:
        echo_json({"folder": str(out), "poses": count, "tip_sigma_um": expected, "random_tip_sigma_um": chance,
                   "seconds": found.seconds, "passed": found.verdict.passed})  # fmt: skip
    elif not quiet:
        click.echo(
            f"{count} poses, {found.seconds:.0f} s: the tip will be known to {expected:.3g} um "
            f"({chance:.3g} um with as many poses chosen by chance)\n"
            f"program: {found.verdict.answer}; it knows no part and no fixture: keep the work volume empty\n"
            f"fill in {out / MEASUREMENTS}, then: pentapod calibrate fit {out / MEASUREMENTS}"
        )
    return 0 if found.verdict.passed else 1


@calibrate.command("fit")
@click.argument("measurements", type=click.Path(path_type=Path))
@click.option("-m", "--machine", "machine_name", help="The machine's file  [default: the shipped one of that name]")
@click.option("-o", "--out", type=click.Path(path_type=Path),
              help="The calibration file  [default: calibration.toml beside MEASUREMENTS]")  # fmt: skip
@click.option("--report", type=HtmlFile(),
              help="The page with the residuals  [default: calibration.html beside the calibration file]")  # fmt: skip
@click.option("--find", multiple=True, type=click.Choice(GROUPS),
              help="Find only these numbers; may be repeated  [default: all, of few docks the zeros]")  # fmt: skip
@click.option("--keep-outliers", is_flag=True, help="Use poses that contradict all others, too.")
@click.option("--date", type=click.DateTime(["%Y-%m-%d"]), help="Day of the measurement  [default: today]")
@json_option
@quiet_option
def fit(
    measurements: Path,
    machine_name: str | None,
    out: Path | None,
    report: Path | None,
    find: tuple[str, ...],
    keep_outliers: bool,
    date: datetime.datetime | None,
    as_json: bool,
    quiet: bool,
) -> int:
    """Find the geometry that fits MEASUREMENTS.csv best, and write the calibration file.

    A machine's file names it: [calibration] file = "calibration.toml". Poses that contradict all others are left out
    and named. Numbers that the poses do not determine stay as designed, and are named.
    """
    from pentapod.base.units import from_si
    from pentapod.machine.calibration.calibration_file import write_calibration
    from pentapod.machine.identification.identification import designed, identify
    from pentapod.machine.identification.measurements_file import read_measurements
    from pentapod.machine.identification.recording import record_of
    from pentapod.machine.report.identified import identified_lines
    from pentapod.report.calibration.page import write_calibration_report

    measured = read_measurements(measurements)
    machine = _machine_of(measured, machine_name, measurements)
    with progress_bar(quiet=quiet or as_json) as progress:
        progress("fit", 0.0, measurements.name)
        found = identify(measured, machine, groups=find, keep_outliers=keep_outliers, file=measurements)
    day = (date or datetime.datetime.now()).date()
    out = measurements.with_name("calibration.toml") if out is None else out
    report = out.with_suffix(".html") if report is None else report
    record = record_of(found.calibration, machine.name, designed(machine), day)
    write_calibration(record, out)
    lines = identified_lines(found, machine)
    write_calibration_report(report, found, machine, lines)
    if as_json:
        made = found.calibration
        echo_json({
            "calibration": str(out), "report": str(report), "digest": record.digest, "poses": len(found.measured),
            "outliers": [str(outlier) for outlier in found.outliers], "identified": list(made.identified),
            "held": list(made.held), "gauges": list(made.gauges), "leg_sigma_um": float(from_si(made.leg_sigma, "um")),
            "tip_sigma_um": float(from_si(found.tip_sigma, "um")),
            "held_out_um": from_si(found.held_out, "um").tolist(),
            "converged": made.converged,
        })  # fmt: skip
    elif not quiet:
        click.echo("\n".join([*lines, f"wrote {out} and {report}",
                              f'use it: in the machine\'s file, [calibration] file = "{out.name}"']))  # fmt: skip
    return 0 if found.calibration.converged else 1


def _machine_of(measured: Measurements, name: str | None, file: Path) -> Machine:
    """Return the machine that was measured. Raises MachineError."""
    from pentapod.base.errors import MachineError
    from pentapod.machine import Machine, shipped_machines

    if name is None and measured.machine not in shipped_machines():
        raise MachineError(
            "no machine ships under this name", file=file, key="machine", value=measured.machine,
            remedy="name the machine's file with --machine",
        )  # fmt: skip
    return Machine.load(name or measured.machine)
