"""pentapod ik and fk: inverse and forward kinematics of one pose, or of CSV on stdin."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pentapod.cli.numbers import Real
from pentapod.cli.output import echo_json, json_option, quiet_option

if TYPE_CHECKING:
    from pentapod.base.arrays import Floats
    from pentapod.kinematics import Branch, Robot

POSE = ("x_mm", "y_mm", "z_mm", "i", "j", "k")

_NEGATIVES = {"ignore_unknown_options": True}  # or -120.5 would be taken for an option
_machine_option = click.option(
    "-m",
    "--machine",
    "machine_name",
    default="desk",
    show_default=True,
    help="Shipped machine, or a machine file.",
)


@click.command(context_settings=_NEGATIVES)
@click.argument("pose", nargs=-1, type=Real(), metavar="[X Y Z I J K]")
@_machine_option
@json_option
@quiet_option
def ik(pose: tuple[float, ...], machine_name: str, as_json: bool, quiet: bool) -> int:
    """Inverse kinematics: leg lengths in mm of a tip X Y Z in mm and a tool axis I J K, machine frame.

    The axis points from the tip to the spindle, as in APT; it need not have unit length. Without numbers, CSV
    is read from stdin: a header "x_mm,y_mm,z_mm,i,j,k", then a pose in each line. For a machine with a leg model
    the commands of the drives follow, for poses that are visited in this order. Exit code 1 where a leg is
    beyond its stroke (`within_strokes`).
    """
    import numpy as np

    from pentapod.base.errors import InputError
    from pentapod.machine import Machine

    machine = Machine.load(machine_name)
    rows = _rows(pose, POSE)
    length = np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)
    if (length == 0.0).any():
        raise InputError("the tool axis is zero", key="i, j, k", expected="a direction from the tip to the spindle")
    direction = -rows[:, 3:] / length
    position = rows[:, :3] * 1e-3 - machine.tool_length * direction
    legs = machine.robot.leg_lengths(position, direction)
    limits = machine.legs
    within = ((legs >= limits.min_length) & (legs <= limits.max_length)).all(axis=1)
    components = [_component(signs) for signs in machine.robot.branch(position, direction)]
    columns: dict[str, Any] = {name: legs[:, k] * 1e3 for k, name in enumerate(leg_names(machine.robot))}
    if machine.leg_model.is_needed:
        told = machine.commands(legs, machine.robot.branch(position, direction))
        columns |= {f"command{k + 1}_mm": told[:, k] * 1e3 for k in range(told.shape[1])}
    columns |= {"component": components, "within_strokes": within.tolist()}
    _print(columns, as_json=as_json, one=bool(pose), quiet=quiet)
    return 0 if within.all() else 1


@click.command(context_settings=_NEGATIVES)
@click.argument("legs", nargs=-1, type=Real(), metavar="[L1 L2 ...]")
@click.option("-c", "--component", help='Its signs: "++", "+-", "-+" or "--"; all of the machine when left out.')
@click.option("--commands", is_flag=True, help="The numbers are what the drives are told (machines with a leg model).")
@click.option("--program", type=click.Path(path_type=Path), metavar="FILE",
              help="Instead of legs: the tool's path of a program, in the frame of the part.")  # fmt: skip
@click.option("--job", type=click.Path(path_type=Path), help="With --program: its job, which names the machine.")
@_machine_option
@json_option
@quiet_option
@click.pass_context
def fk(
    ctx: click.Context,
    legs: tuple[float, ...],
    component: str | None,
    commands: bool,
    program: Path | None,
    job: Path | None,
    machine_name: str,
    as_json: bool,
    quiet: bool,
) -> int:
    """Forward kinematics: tips in mm, tool axes and distances to singularities of leg lengths in mm.

    Five legs have four poses, one in each component, or none. Without numbers, CSV is read from stdin: a
    header "leg1_mm,leg2_mm,...", then one set of legs in each line. nan: no such pose. Exit code 1 where a
    set of legs has no pose.

    With --program FILE: times, tips and axes of its rows, in the frame of the part, as the program's legs put
    them. The machine is that of the program, as in `pentapod post`.
    """
    import numpy as np

    from pentapod.machine import Machine

    if program is not None:
        if legs or component is not None or commands:
            raise click.UsageError("--program takes no legs, --component and --commands", ctx)
        default = ctx.get_parameter_source("machine_name") is click.core.ParameterSource.DEFAULT
        _print(_tool_path(program, job, None if default else machine_name), as_json=as_json, one=False, quiet=quiet)
        return 0
    if job is not None:
        raise click.UsageError("--job needs --program", ctx)
    machine = Machine.load(machine_name)
    robot = machine.robot
    rows = _rows(legs, leg_names(robot)) * 1e-3
    chosen = list(robot.branches) if component is None else [_named(robot, component)]
    each = np.repeat(rows[:, None, :], len(chosen), axis=1)
    if commands:
        each = np.stack([machine.readings(rows, branch) for branch in chosen], axis=1)
    position, direction = machine.robot.pose(each, np.array(chosen))
    position, direction = position.reshape(-1, 3), direction.reshape(-1, 3)
    tips = (position + machine.tool_length * direction) * 1e3
    columns: dict[str, Any] = {"row": np.repeat(np.arange(len(rows)), len(chosen)).tolist()}
    columns["component"] = [str(c) for c in chosen] * len(rows)
    columns |= {name: tips[:, k] for k, name in enumerate(POSE[:3])}
    columns |= {name: -direction[:, k] for k, name in enumerate(POSE[3:])}
    columns |= _distances(robot, position, direction)
    _print(columns, as_json=as_json, one=bool(legs) and component is not None, quiet=quiet)
    return 0 if np.isfinite(tips).all() else 1


def _tool_path(file: Path, job: Path | None, machine_name: str | None) -> dict[str, Any]:
    """Return times, tips and axes (from the tip to the spindle) of a program's rows in the frame of the part."""
    from pentapod.cli.commands.post import program_machine
    from pentapod.program import read_csv
    from pentapod.program.commands import read_back
    from pentapod.program.posts import PostInput

    program = read_csv(file)
    machine = PostInput(program, program_machine(program, file.parent, job, machine_name)).the_machine()
    program = read_back(program, machine)
    position, direction = machine.robot.pose(program.legs, program.component)
    home = program.placement.inverse()
    tips, axes = home.apply(position + machine.tool_length * direction) * 1e3, home.rotate(-direction)
    columns = {name: tips[:, k] for k, name in enumerate(POSE[:3])}
    return {"time_s": program.times, **columns, **{name: axes[:, k] for k, name in enumerate(POSE[3:])}}


def leg_names(robot: Robot) -> tuple[str, ...]:
    """Return the columns of a robot's legs."""
    return tuple(f"leg{k}_mm" for k in range(1, robot.n_legs + 1))


def _named(robot: Robot, name: str) -> Branch:
    """Return the branch of a name. Raises InputError."""
    from pentapod.base.errors import InputError

    for branch in robot.branches:
        if str(branch) == name:
            return branch
    known = ", ".join(f'"{branch}"' for branch in robot.branches)
    raise InputError("unknown component", key="--component", value=name, expected=known)


def _distances(robot: Robot, position: Floats, direction: Floats) -> dict[str, Any]:
    """Return how far poses (N, 3) are from singularities, in mm and, where a closed form gives it, in degrees."""
    import numpy as np

    from pentapod.kinematics import LinearPentapod, orientation_distance, position_distance
    from pentapod.kinematics.arithmetic import NUMPY

    if isinstance(robot, LinearPentapod):
        turn = orientation_distance(robot, position, direction)
        return {
            "singularity_mm": position_distance(robot, position, direction) * 1e3,
            "singularity_deg": np.degrees(turn),
        }
    margins = robot.singularity_margins(list(position.T), list(direction.T), robot.branches[0], NUMPY)
    far = [np.abs(m) for m, of in zip(margins, robot.singularities, strict=True) if of.unit == "mm"]
    return {"singularity_mm": np.min(far, axis=0) * 1e3}


def _component(signs: Sequence[int]) -> str:
    return "".join("+" if sign > 0 else "-" if sign < 0 else "0" for sign in signs)


def _rows(numbers: tuple[float, ...], names: tuple[str, ...]) -> Floats:
    """Return the numbers of the command line (1, n), or those of the CSV on stdin (N, n)."""
    import numpy as np

    from pentapod.base.errors import InputError

    if numbers:
        if len(numbers) != len(names):
            raise InputError("wrong count of numbers", value=len(numbers), expected=" ".join(names))
        return np.array([numbers])
    if sys.stdin.isatty():
        raise InputError("no numbers given", expected=" ".join(names), remedy="or CSV on stdin")
    # Lines are numbered with the blank ones.
    try:
        lines = [(number, line.strip()) for number, line in enumerate(sys.stdin, start=1) if line.strip()]
    except UnicodeDecodeError as error:
        raise InputError("not UTF-8 text", file="stdin", expected=",".join(names)) from error
    if not lines or tuple(field.strip() for field in lines[0][1].split(",")) != names:
        got = lines[0][1][:80] if lines else "nothing"
        raise InputError("wrong header", file="stdin", line=1, value=got, expected=",".join(names))
    return np.array([_row(line, number, names) for number, line in lines[1:]]).reshape(-1, len(names))


def _row(line: str, number: int, names: tuple[str, ...]) -> list[float]:
    """Return the numbers of a line of the CSV on stdin. Raises InputError with its number."""
    from pentapod.base.errors import InputError
    from pentapod.base.files import number_in

    fields = line.split(",")
    row = [value for field in fields if (value := number_in(field)) is not None]
    if len(fields) == len(names) == len(row):
        return row
    what = "not a row of finite numbers" if len(fields) == len(names) else "wrong count of numbers"
    raise InputError(what, file="stdin", line=number, value=line[:80], expected=",".join(names))


def _print(columns: dict[str, Any], *, as_json: bool, one: bool, quiet: bool) -> None:
    """Print columns of equal length: as JSON (an object for one row, else a list), or, unless quiet, as CSV."""
    values = [list(column) for column in columns.values()]
    records = [dict(zip(columns, (_plain(v) for v in row), strict=True)) for row in zip(*values, strict=True)]
    if as_json:
        echo_json(records[0] if one else records)
        return
    if quiet:
        return
    lines = [",".join(columns)]
    lines += [",".join(_text(value) for value in record.values()) for record in records]
    click.echo("\n".join(lines))


def _plain(value: Any) -> Any:
    return value if isinstance(value, (str, bool, int)) else float(value)


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.9f}" if isinstance(value, float) else str(value)
