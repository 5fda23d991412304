"""pentapod machine: list, explain and check machines, and compare two calibrations of one."""

from __future__ import annotations

from pathlib import Path

import click

from pentapod.cli.numbers import Real
from pentapod.cli.output import echo_json, json_option, quiet_option
from pentapod.cli.progress import progress_bar


@click.group()
def machine() -> None:
    """Explain and check machines."""


@machine.command("list")
@json_option
@quiet_option
def list_machines(as_json: bool, quiet: bool) -> int:
    """List the machines that ship with pentapod."""
    from pentapod.machine import shipped_machines

    names = list(shipped_machines())
    if as_json:
        echo_json(names)
    elif not quiet:
        click.echo("\n".join(names))
    return 0


@machine.command("new")
@click.argument("file", type=click.Path(path_type=Path), metavar="FILE.toml")
@click.option("--like", default="desk", show_default=True, help="Shipped machine, or a machine file: all values.")
@json_option
@quiet_option
def new_machine(file: Path, like: str, as_json: bool, quiet: bool) -> int:
    """Write a machine file with a remark on each key, to fill in the numbers of your machine."""
    from pentapod.base.errors import InputError
    from pentapod.base.files import atomic_write
    from pentapod.machine.report.commented import commented_machine

    if file.exists():
        raise InputError("the file is there already", file=file, remedy="choose another name, or remove it")
    text = commented_machine(like, file.stem)
    with atomic_write(file) as temporary:
        temporary.write_text(text, encoding="utf-8")
    if as_json:
        echo_json({"machine": str(file), "like": like})
    elif not quiet:
        click.echo(f"wrote {file}: the values are those of {like}; `pentapod machine check {file}` judges them")
    return 0


@machine.command()
@click.argument("name_or_file")
@json_option
@quiet_option
def check(name_or_file: str, as_json: bool, quiet: bool) -> int:
    """Explain a machine (a shipped NAME or a FILE.toml), and whether it keeps its limits in its work volume.

    Exit code 1 where it does not; 2 where the file describes a machine that cannot exist.
    """
    from pentapod.machine import Machine, explain
    from pentapod.machine import check as check_machine

    with progress_bar(quiet=quiet or as_json) as progress:
        progress("check", 0.0, name_or_file)
        report = check_machine(Machine.load(name_or_file))
    passed = all(finding.passed for finding in report.findings)
    if as_json:
        findings = [
            {"name": found.name, "passed": bool(found.passed), "value": float(found.value), "must_be": found.kind,
             "limit": float(found.limit), "unit": found.unit, "where": found.where}
            for found in report.findings
        ]  # fmt: skip
        described = {"machine": report.machine.name, "digest": report.machine.digest}
        echo_json({**described, "passed": passed, "findings": findings})
    elif not quiet:
        click.echo(explain(report))
    return 0 if passed else 1


@machine.command("linuxcnc")
@click.argument("name_or_file")
@click.option("-o", "--out", type=click.Path(path_type=Path), required=True, help="Folder to write.")
@json_option
@quiet_option
def linuxcnc(name_or_file: str, out: Path, as_json: bool, quiet: bool) -> int:
    """Write a kinematics module for LinuxCNC with a simulation, to drive a machine (NAME or FILE.toml) by hand.

    For the quadratic family, as designed or as measured. `pentapod post --to linuxcnc` adds a program's toolpath.
    """
    from pentapod.machine import Machine
    from pentapod.program.posts.linuxcnc.kinematics import upright_component, write_kinematics

    made = Machine.load(name_or_file)
    files = write_kinematics(made, upright_component(made), out)
    if as_json:
        echo_json({"machine": made.name, "digest": made.digest, "files": [str(file) for file in files]})
    elif not quiet:
        click.echo(f"wrote {out}: kinematics module and simulation of {made.name}; see {out / 'README.md'}")
    return 0


@machine.command("structured-text")
@click.argument("name_or_file")
@click.option("-o", "--out", type=click.Path(path_type=Path), required=True, help="File to write, such as desk.st.")
@json_option
@quiet_option
def structured_text_of(name_or_file: str, out: Path, as_json: bool, quiet: bool) -> int:
    """Write the kinematics of a machine (NAME or FILE.toml) as Structured Text, for CODESYS and TwinCAT.

    A function block with the methods CartesianToAxes and AxesToCartesian, and the margin of each limit. For the
    quadratic family, as designed or as measured.
    """
    from pentapod.base.files import atomic_write
    from pentapod.machine import Machine
    from pentapod.program.posts.codesys.structured_text import structured_text

    made = Machine.load(name_or_file)
    text = structured_text(made)
    with atomic_write(out) as temporary:
        temporary.write_text(text, encoding="utf-8")
    if as_json:
        echo_json({"machine": made.name, "digest": made.digest, "file": str(out)})
    elif not quiet:
        click.echo(f"wrote {out}: function block PentapodKinematics of {made.name}")
    return 0


@machine.command("drift")
@click.argument("first", type=click.Path(path_type=Path))
@click.argument("second", type=click.Path(path_type=Path))
@click.option("-m", "--machine", "machine_name", help="The machine's file  [default: the shipped one of that name]")
@click.option("--within", "within_mm", type=Real(0.0, min_open=True), metavar="MM",
              help="Fail if the tip has moved further anywhere.")  # fmt: skip
@json_option
@quiet_option
def compare(
    first: Path, second: Path, machine_name: str | None, within_mm: float | None, as_json: bool, quiet: bool
) -> int:
    """Say what has moved from one calibration file to another: in mm, in standard deviations, and at the tip."""
    from pentapod.base.errors import MachineError
    from pentapod.base.units import from_si
    from pentapod.machine import Machine, shipped_machines
    from pentapod.machine.calibration.calibration_file import read_calibration
    from pentapod.machine.calibration.parameters import PARAMETERS
    from pentapod.machine.report.drift import drift, drift_text

    before, after = read_calibration(first), read_calibration(second)
    if machine_name is None and before.machine not in shipped_machines():
        raise MachineError(
            "no machine ships under this name", file=first, key="machine", value=before.machine,
            remedy="name the machine's file with --machine",
        )  # fmt: skip
    found = drift(before, after, Machine.load(machine_name or before.machine))
    largest = float(from_si(found.largest, "mm"))
    if as_json:
        changes, sigmas = from_si(found.changes, "mm").tolist(), from_si(found.sigmas, "mm").tolist()
        echo_json({
            "changes_mm": dict(zip(PARAMETERS, changes, strict=True)),
            "sigmas_mm": dict(zip(PARAMETERS, sigmas, strict=True)),
            "moved_mm": {one.name: float(from_si(one.change, "mm")) for one in found.moved},
            "chance": found.chance, "tip_largest_mm": largest,
            "tip_sigma_mm": float(from_si(found.tip_sigma, "mm")),
        })  # fmt: skip
    elif not quiet:
        click.echo(drift_text(found))
    return 1 if within_mm is not None and largest > within_mm else 0


@machine.group("import")
def import_machine() -> None:
    """Make a machine file from another program's configuration."""


@import_machine.command("hal")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-o", "--out", type=click.Path(path_type=Path), required=True, help="Machine file to write.")
@click.option("--ini", type=click.Path(path_type=Path), help="Ini file of LinuxCNC: strokes and limits of the legs.")
@click.option("--like", default="desk", help="Shipped machine, or a machine file: joints, bodies, controller.")
@json_option
@quiet_option
def import_hal(file: Path, out: Path, ini: Path | None, like: str, as_json: bool, quiet: bool) -> int:
    """Make a machine of the pentakins parameters in a HAL FILE of LinuxCNC, rings and all.

    What HAL and the ini file do not say is that of the machine LIKE: change it in OUT.
    """
    from pentapod.base.errors import MachineError
    from pentapod.base.files import atomic_write
    from pentapod.base.toml import parsed
    from pentapod.machine import Machine, read_machine
    from pentapod.machine.hal_import import LEGS, machine_text, read_limits, read_pentakins
    from pentapod.machine.reader import machine_bytes

    if (count := Machine.load(like).robot.n_legs) != LEGS:
        raise MachineError("not a machine of five legs", key="--like", value=like, expected=f"{LEGS} legs, not {count}")
    content = parsed(machine_bytes(like).decode("utf-8-sig"), like, MachineError)
    text = machine_text(read_pentakins(file), out.stem, content, read_limits(ini) if ini else {})
    made = read_machine(text, out)
    with atomic_write(out) as temporary:
        temporary.write_text(text, encoding="utf-8")
    if as_json:
        echo_json({"machine": str(out), "digest": made.digest})
    elif not quiet:
        click.echo(f"wrote {out}; all but the geometry{' and the limits of the legs' if ini else ''} is that of {like}")
    return 0
