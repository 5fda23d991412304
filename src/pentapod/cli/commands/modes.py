"""pentapod modes: which poses fit the legs' readings at power-on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from pentapod.cli.numbers import Real
from pentapod.cli.output import echo_json, json_option, quiet_option

if TYPE_CHECKING:
    from pentapod.machine import AssemblyPose


@click.command()
@click.option("--legs", required=True, metavar="L1,L2,...", help="What the legs' scales read, mm, leg 1 first.")
@click.option(
    "--rails", metavar="P1,P2,...", help="Where the rails of a reconfigurable machine stand, mm; 0 if left out."
)
@click.option("--error", "error_mm", type=Real(0.0), default=0.01, show_default=True, metavar="MM",
              help="By how much each reading may be wrong.")  # fmt: skip
@click.option("-m", "--machine", "machine_name", default="desk", show_default=True,
              help="Shipped machine, or a machine file.")  # fmt: skip
@json_option
@quiet_option
def modes(legs: str, rails: str | None, error_mm: float, machine_name: str, as_json: bool, quiet: bool) -> int:
    """Show which poses of the tool fit the lengths of the legs, and strokes, joints and bodies of the machine.

    After power-on a controller knows only the lengths of the legs. The true pose is always among those that fit, within
    the error of the readings; if this cannot be proven, the command refuses. Exit code 1 then, and if more or fewer
    than one fit.
    """
    from pentapod.base.refusal import Refusal
    from pentapod.machine import Machine, admissible_modes

    machine = Machine.load(machine_name)
    if rails is not None:
        machine = machine.at(_metres(rails, "--rails", machine.robot.n_legs))
    lengths = _metres(legs, "--legs", machine.robot.n_legs)
    found = admissible_modes(machine, lengths, leg_error=1e-3 * error_mm)
    if isinstance(found, Refusal):
        if as_json:
            echo_json({"machine": machine.name, "proven": False, "cause": str(found)})
        click.echo(f"refused: {found}", err=True)
        return 1
    fitting = len(found.admissible)
    if as_json:
        rows = [_row(pose) for pose in found.poses]
        echo_json(
            {"machine": machine.name, "proven": True, "complete": found.complete, "fitting": fitting, "modes": rows}
        )
    elif not quiet:
        known = "proven complete" if found.complete else "that there is no other is not proven"
        count = len(found.poses)
        click.echo(f"{machine.name}: {count} modes ({known}), {fitting} " + ("fits" if fitting == 1 else "fit"))
        for pose in found.poses:
            tip, axis = (
                ", ".join(f"{x:{form}}" for x in v) for v, form in ((1e3 * pose.tip, ".3f"), (pose.axis, "+.4f"))
            )
            verdict = "fits" if pose.located else "not excluded, as it is close to a singularity"
            verdict = _words(pose.excluded) if pose.excluded else verdict
            click.echo(f"  {pose.branch}  tip ({tip}) mm, tool axis ({axis}): {verdict}")
    if fitting != 1 and not quiet:
        told = "look at the machine to tell them apart" if fitting else "readings, machine file or their order is wrong"
        click.echo(f"{fitting} modes fit: {told}", err=True)
    return 0 if fitting == 1 else 1


def _metres(text: str, option: str, count: int) -> list[float]:
    """Return `count` numbers of an option, given in millimetres. Raises InputError."""
    from pentapod.base.errors import InputError
    from pentapod.base.files import number_in

    numbers = [number_in(word) for word in text.replace(",", " ").split()]
    known = [1e-3 * number for number in numbers if number is not None]
    if not len(known) == len(numbers) == count:
        raise InputError("wrong numbers", key=option, value=text, expected=f"{count} numbers, mm, with commas between")
    return known


def _words(excluded: tuple[str, ...]) -> str:
    more = len(excluded) - 1
    return excluded[0] + (f", and {more} more limits" if more > 1 else f"; {excluded[1]}" if more else "")


def _row(pose: AssemblyPose) -> dict[str, Any]:
    return {
        "component": str(pose.branch), "fits": pose.fits, "tip_mm": [1e3 * float(x) for x in pose.tip],
        "axis": [float(x) for x in pose.axis], "tip_error_mm": 1e3 * pose.error, "excluded": list(pose.excluded),
    }  # fmt: skip
