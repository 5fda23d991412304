"""Claims on the provenance of a program: machine, guides, controller, job and component of its header."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.base.errors import InputError
from pentapod.geometry.polyline import arc_length
from pentapod.program.commands import cutting_rows, read_back
from pentapod.program.program import GRAVITY, PROCESS
from pentapod.toolpath.process import laser_power
from pentapod.toolpath.toolpath import SegmentKind, Toolpath
from pentapod.verify.replay.claim import MM, Claim, Finding, Idle
from pentapod.verify.replay.replay import Replay
from pentapod.verify.verdict.verdict import Place

GUIDES = "guides within their travel"


def machine(replay: Replay) -> Finding:
    """Judge that the program was made for this machine, by name and by digest."""
    made_for, judged = replay.program.provenance, replay.machine
    if made_for.commands:
        try:
            read_back(replay.program, judged)
        except InputError as error:
            return Finding.without_value(False, f"header: {error}")
        return Finding.without_value(False, "header: the rows are commands of drives")
    if made_for.compensation and not judged.yielding_known:
        return Finding.without_value(
            False, f"header: compensation of {made_for.compensation}, but the machine does not say how far legs yield"
        )
    passed = made_for.machine == judged.name and made_for.machine_digest == judged.digest
    made = f"header: made for {_named(made_for.machine, made_for.machine_digest, made_for.calibration)}"
    return Finding.without_value(
        passed, f"{made}, judged on {_named(judged.name, judged.digest, judged.calibration_name)}"
    )


def _named(name: str, digest: str, calibration: str) -> str:
    return f"{name} ({digest}{f', calibration {calibration}' if calibration else ''})"


def job(replay: Replay) -> Finding | Idle:
    """Judge that the program was made from this job, by digest; idle where there is no job on either side."""
    made_from, required = replay.program.provenance.job_digest, replay.specification.job_digest
    if required is None and not made_from:
        return Idle("the program was made without a job, and none is given")
    if required is None:
        return Idle(f"the program was made from job {made_from}; no job is given to compare with", unknown=True)
    method = f"header: made from job {made_from or 'none'}, judged for job {required}"
    return Finding.without_value(made_from == required, method)


def guides(replay: Replay) -> Finding | Idle:
    """Judge that the guides of a reconfigurable machine are within their travel; idle for other machines."""
    machine, rail_positions = replay.machine, replay.program.rail_positions
    if machine.guides is None and rail_positions is not None:
        return Finding.without_value(False, "the header has positions of guides, but this machine has no guides")
    if machine.guides is None:
        return Idle("the machine has no guides")
    if rail_positions is None:
        return Finding(False, None, 0.0, "mm", Place(), "the header has no positions of the guides", at_least=True)
    least, greatest = machine.guides.travel.T
    distances = MM * np.minimum(np.array(rail_positions) - least, greatest - np.array(rail_positions))
    positions = ", ".join(f"{MM * position:.6g}" for position in rail_positions)
    method = f"header: guides at {positions} mm; smallest distance of a guide to an end of its travel"
    return Finding(bool(distances.min() >= 0.0), float(distances.min()), 0.0, "mm", Place(), method, at_least=True)


def component(replay: Replay) -> Finding | Idle:
    """Judge that the program is in the requested component; idle where any is allowed."""
    required, own = replay.specification.component, replay.program.component
    if required is None:
        return Idle("any component is allowed")
    return Finding.without_value(own == required, f"header: component {own}, requested: {required}")


def controller(replay: Replay) -> Finding:
    """Judge that the rows have the period and the interpolation of the machine's controller."""
    program, own = replay.program, replay.machine.controller
    passed = program.period == own.period and program.interpolation == own.interpolation
    method = (
        f"header: period {program.period:.9g} s, {program.interpolation} interpolation; controller of machine and job: "
        f"period {own.period:.9g} s, {own.interpolation} interpolation"
    )
    return Finding.without_value(passed, method)


def compensation(replay: Replay) -> Finding | Idle:
    """Judge that drives compensate for what is asked, by the header; idle where nothing is asked, or neither has any.

    Rows nearer to the end of a cut than the path may be from the toolpath, and a row more, may count either way.
    """
    asked, program, force = replay.specification.compensation, replay.program, replay.program.process_force
    own, told = program.provenance.compensation, cutting_rows(program)
    if asked is None or not (asked or own):
        return Idle("nothing is asked for, or neither the job nor the header asks for it")
    newtons = 0.0 if force is None else force.newtons
    wanted = replay.machine.cutting_force if asked == PROCESS else 0.0
    method = f"header: drives compensate for {_loads(own, newtons)}; asked for: {_loads(asked and GRAVITY, wanted)}"
    if own != (asked and GRAVITY) or (force is not None and newtons != wanted):
        return Finding.without_value(False, method)
    wrong = (_inside(replay.cuts()) & ~told) | (_inside(replay.off_cuts()) & told)
    if asked == PROCESS and wrong.any():
        where = replay.place(2 * int(wrong.argmax()))
        return Finding.without_value(False, f"{method}; the rows of cuts are not those of the toolpath", where)
    return Finding.without_value(True, method)


def _loads(compensation: str, newtons: float) -> str:
    """Return what drives compensate for, in words."""
    return (compensation or "nothing") + (f", and {newtons:g} N against the motion on cuts" if newtons else "")


def _inside(rows: Bools) -> Bools:
    """Return those rows (N,) whose neighbours are among them, too."""
    wide = np.pad(rows, 1, mode="edge")
    return wide[:-2] & rows & wide[2:]


def process(replay: Replay) -> Finding | Idle:
    """Judge that spindle, coolant, tool and laser are switched as the toolpath says, and where; idle where none is.

    A switch may be as far from its waypoint as the path may be from the toolpath, and as far as the tool moves in a
    period.
    """
    program, toolpath = replay.program, replay.toolpath
    said = [*(segment.words for segment in toolpath.segments), toolpath.end_words]
    if not any(said) and not program.switches and program.laser_power is None:
        return Idle("neither the toolpath nor the program says anything of spindle, coolant, tool and laser")
    arcs, travelled = arc_length(toolpath.tilt_centres)[toolpath.starts], replay.match.arcs[::2]
    room = 2.0 * replay.match_radius + np.abs(np.diff(travelled, prepend=travelled[0])).max()
    wanted = [(at, word) for at, words in enumerate(said) for word in words if laser_power(word) is None]
    found = [(switch.row, word) for switch in program.switches for word in switch.words]
    if [" ".join(word.split()) for _, word in wanted] != [word for _, word in found]:
        return Finding.without_value(False, "the words of the header's switches are not those of the toolpath")
    off = [abs(float(travelled[row] - arcs[at])) for (at, _), (row, _) in zip(wanted, found, strict=True)]
    rows = [row for row, _ in found]
    shares, power = _powers(toolpath, said), program.laser_power
    if (power is None) != (shares is None):
        return Finding.without_value(False, "the laser's power is not that of the toolpath: on one side there is none")
    if power is not None and shares is not None:
        first, last = (np.clip(np.searchsorted(arcs, travelled + d), 1, len(shares)) - 1 for d in (-room, room))
        near, wrong = first, np.abs(power - shares[first]) > 1e-6
        while (near < last).any():
            near = np.minimum(near + 1, last)
            wrong &= np.abs(power - shares[near]) > 1e-6
        if wrong.any():
            row = int(np.argmax(wrong))
            return Finding.without_value(False, "the laser's power is not that of the toolpath", replay.place(2 * row))
    worst = int(np.argmax(off)) if off else None
    where = Place() if worst is None else replay.place(2 * rows[worst])
    method = f"{len(found)} words in order, each at its waypoint; the laser is off where nothing is cut"
    return Finding.at_most(0.0 if worst is None else off[worst], float(room), MM, "mm", where, method)


def _powers(toolpath: Toolpath, said: list[tuple[str, ...]]) -> Floats | None:
    """Return the laser's power (S,) on each segment; None where no word sets it."""
    share, shares = None, list[float]()
    for segment, words in zip(toolpath.segments, said, strict=False):
        share = next((power for word in reversed(words) if (power := laser_power(word)) is not None), share)
        shares.append((share or 0.0) if segment.kind is SegmentKind.CUT else 0.0)
    return None if share is None else np.array(shares)


CLAIMS = (
    Claim("machine", machine, needs_pose=False),
    Claim(GUIDES, guides, needs_pose=False),
    Claim("controller", controller, needs_pose=False),
    Claim("job", job, needs_pose=False),
    Claim("component as asked", component, needs_pose=False),
    Claim("process data", process),
    Claim("compensation as asked", compensation),
)
