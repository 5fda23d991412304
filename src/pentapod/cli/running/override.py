"""pentapod override: a program with feed override and holds, as the LinuxCNC player plays it."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pentapod.base.errors import InputError
from pentapod.base.files import number_in
from pentapod.cli.output import echo_json, json_option, quiet_option

if TYPE_CHECKING:
    from pentapod.base.arrays import Floats

ALLOWED = 1.0 + 1e-5
"""Share of a limit: lengths of programs are rounded, and their third differences show it."""

PATH_M = 1e-6
"""Metres by which a leg may be off the program's path."""

AFTER_S = 5.0
"""Seconds that are played beyond what the changes ask for."""

LEAST, MOST = 5.0, 120.0
"""Percent of the pace that may be asked for."""

EXPECTED = f"SECONDS:PERCENT with {LEAST:g} to {MOST:g} %, or SECONDS:hold, :resume, :abort, in the order of time"


@click.command()
@click.argument("program", type=click.Path(path_type=Path))
@click.argument("changes", nargs=-1, metavar="[SECONDS:CHANGE]...")
@click.option("--job", type=click.Path(path_type=Path), help="The job of the program; it names the machine.")
@click.option("--machine", help="The machine's name or file, without --job.")
@click.option("-o", "--out", type=click.Path(path_type=Path), metavar="FILE.csv", help="Write the setpoints played.")
@json_option
@quiet_option
def override(
    program: Path, changes: tuple[str, ...], job: Path | None, machine: str | None, out: Path | None, as_json: bool,
    quiet: bool,
) -> int:  # fmt: skip
    """Play PROGRAM.csv with changes of the feed override, such as 2:50 4:hold 6:resume 7:120.

    It is played by the C source of the LinuxCNC post's player, compiled here; LinuxCNC is not needed, a C compiler is.
    The setpoints are then compared with the limits of the legs and with the program. Exit code 1 if they exceed a limit
    or leave the path by 1 um.
    """
    import numpy as np

    from pentapod.cli.commands.post import program_machine
    from pentapod.program import read_csv
    from pentapod.program.commands import commanded
    from pentapod.program.posts import PostInput
    from pentapod.simulate.paced import Player

    steps = [_change(text) for text in changes]
    if any(b[0] < a[0] for a, b in pairwise(steps)):
        raise InputError("the changes are not in the order of time", key="changes", value=" ".join(changes))
    read = read_csv(program)
    given = PostInput(read, program_machine(read, program.parent, job, machine))
    of_program = given.the_machine()
    wanted = _overrides(steps, len(read.legs), read.period)
    run = Player(commanded(read, of_program), of_program).play(wanted)
    kept, off = run.shares, run.off_path
    passed = max(kept.values()) <= ALLOWED and off <= PATH_M
    done = bool(run.rows[-1] >= len(read.legs) - 1)
    times = np.arange(len(run.legs)) * read.period
    if out is not None:
        from pentapod.base.files import atomic_write

        names = ",".join(("time_s", *(f"leg{k + 1}_mm" for k in range(run.legs.shape[1])), "row", "pace"))
        table = np.column_stack([times, 1e3 * run.legs, run.rows, run.paces])
        with atomic_write(out) as temporary:
            np.savetxt(temporary, table, "%.8f", ",", header=names, comments="")
    content = {
        "passed": passed, "to_the_end": done, "duration_s": float(times[-1]), "program_s": read.duration,
        "shares_of_limits": kept, "off_path_um": 1e6 * off,
        "pace": {"least": float(run.paces.min()), "most": float(run.paces.max())},
    }  # fmt: skip
    if as_json:
        echo_json({**content, **({} if out is None else {"file": str(out)})})
    elif not quiet:
        end = "to the end" if done else f"standing at {run.rows[-1] * read.period:.3f} s of the program"
        lines = [f"played for {times[-1]:.3f} s, {end}; the program of {read.duration:.3f} s"]
        lines += [f"  leg {name}: {100.0 * share:.2f} % of the limit" for name, share in kept.items()]
        lines.append(f"  off the program's path: {1e6 * off:.3g} um of a leg")
        click.echo("\n".join([*lines, *([] if out is None else [f"  setpoints: {out}"])]))
    if not passed:
        click.echo("a limit is exceeded, or the path is left; does the program keep them itself?", err=True)
    return 0 if passed else 1


def _change(text: str) -> tuple[float, str, float]:
    """Return time, word and share of a change. Raises InputError."""
    when, _, what = text.partition(":")
    seconds, percent = number_in(when), number_in(what)
    if what in ("hold", "resume", "abort"):
        percent = 0.0
    good = percent is not None and (what.isalpha() or percent == 0.0 or LEAST <= percent <= MOST)
    if seconds is None or percent is None or seconds < 0.0 or not good:
        raise InputError("not a change of the override", key="changes", value=text, expected=EXPECTED)
    return seconds, what, 1e-2 * percent


def _overrides(steps: list[tuple[float, str, float]], rows: int, period: float) -> Floats:
    """Return the override in each period, for as many as the program can need."""
    import numpy as np

    share, held, shares = 1.0, False, list[tuple[int, float]]()
    for seconds, what, percent in steps:
        held = True if what in ("hold", "abort") else False if what == "resume" else held
        share = share if what.isalpha() else percent
        shares.append((round(seconds / period), 0.0 if held else share))
        if what == "abort":
            break
    last, final = shares[-1] if shares else (0, 1.0)
    count = last + round(AFTER_S / period) + (round(rows / final * 2.0) if final > 0.0 else 0)
    wanted = np.ones(count)
    for start, value in shares:
        wanted[start:] = value
    return wanted
