"""pentapod warm-up: compile the fast kernels before the first job needs them."""

from __future__ import annotations

import time

import click

from pentapod.cli.numbers import Whole
from pentapod.cli.output import echo_json, json_option, quiet_option
from pentapod.cli.progress import progress_bar


@click.command("warm-up")
@click.option("-j", "--processes", type=Whole(1), metavar="N",
              help="How many processes compile; one for each core if left out.")  # fmt: skip
@json_option
@quiet_option
def warm_up(processes: int | None, as_json: bool, quiet: bool) -> int:
    """Compile the fast kernels, on all cores, once on a machine and for each version.

    Without it the first job compiles what it needs, on one core.
    """
    from pentapod.numerics import warm_up as kernels

    start = time.perf_counter()
    with progress_bar(quiet=quiet or as_json) as progress:
        done, compiled = kernels.warm_up(processes, progress)
    names = len({name for name, _ in kernels.signatures()})
    seconds = time.perf_counter() - start
    if as_json:
        echo_json({"ready": done, "compiled": compiled, "seconds": seconds})
    elif not quiet:
        click.echo(
            f"{names} kernels are ready, in {done} forms for the types of their arguments; {compiled} forms compiled "
            f"now, {seconds:.0f} s"
        )
    return 0
