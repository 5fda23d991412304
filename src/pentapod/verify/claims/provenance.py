"""Claims about where the program comes from: its machine, its job."""

from __future__ import annotations

import numpy as np

from pentapod.verify.replay.claim import MM, Claim, Finding, Idle
from pentapod.verify.replay.replay import Replay
from pentapod.verify.verdict.verdict import Place

GUIDES = "guides within their travel"


def machine(replay: Replay) -> Finding:
    """Judge that the program was made for this machine, by name and by digest."""
    made_for, judged = replay.program.provenance, replay.machine
    passed = made_for.machine == judged.name and made_for.machine_digest == judged.digest
    method = (
        f"header: made for {made_for.machine} ({made_for.machine_digest}), judged on {judged.name} ({judged.digest})"
    )
    return Finding(passed, None, None, "", Place(), method)


def job(replay: Replay) -> Finding | Idle:
    """Judge that the program was made from this job, by digest; not asked where there is none on either side."""
    made_from, asked = replay.program.provenance.job_digest, replay.specification.job_digest
    if asked is None and not made_from:
        return Idle("the program was made without a job, and none is asked for")
    if asked is None:
        return Idle(f"the program was made from job {made_from}; no job is given to compare with", unknown=True)
    method = f"header: made from job {made_from or 'none'}, judged for job {asked}"
    return Finding(made_from == asked, None, None, "", Place(), method)


def guides(replay: Replay) -> Finding | Idle:
    """Judge that the guides of a reconfigurable machine stand within their travel; not asked of other machines."""
    machine, rail_positions = replay.machine, replay.program.rail_positions
    if machine.guides is None and rail_positions is not None:
        return Finding(False, None, None, "", Place(), "the header tells where guides stand; this machine has none")
    if machine.guides is None:
        return Idle("the machine has no guides")
    if rail_positions is None:
        return Finding(False, None, 0.0, "mm", Place(), "the header does not say where the guides stand")
    least, greatest = machine.guides.travel.T
    rooms = MM * np.minimum(np.array(rail_positions) - least, greatest - np.array(rail_positions))
    stand = ", ".join(f"{MM * slide:.6g}" for slide in rail_positions)
    method = f"header: guides at {stand} mm; the least room to an end of their travel"
    return Finding(bool(rooms.min() >= 0.0), float(rooms.min()), 0.0, "mm", Place(), method)


def component(replay: Replay) -> Finding | Idle:
    """Judge that the program works in the component that is asked for; not asked where any will do."""
    asked, own = replay.specification.component, replay.program.component
    if asked is None:
        return Idle("any component will do")
    return Finding(own == asked, None, None, "", Place(), f"header: component {own}, asked for: {asked}")


def controller(replay: Replay) -> Finding:
    """Judge that the rows are meant for this machine's controller: its period and its motion between rows."""
    program, own = replay.program, replay.machine.controller
    passed = program.period == own.period and program.interpolation == own.interpolation
    method = (
        f"header: a row each {program.period:.9g} s, {program.interpolation} between rows; the controller, as machine "
        f"and job set it, takes one each {own.period:.9g} s, {own.interpolation} between rows"
    )
    return Finding(passed, None, None, "", Place(), method)


CLAIMS = (
    Claim("machine", machine, needs_pose=False),
    Claim(GUIDES, guides, needs_pose=False),
    Claim("controller", controller, needs_pose=False),
    Claim("job", job, needs_pose=False),
    Claim("component as asked", component, needs_pose=False),
)
