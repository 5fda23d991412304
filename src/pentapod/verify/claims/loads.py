"""Claims about loads at the rows: the forces of the drives, and how far the tip is deflected by them."""

from __future__ import annotations

import numpy as np

from pentapod.verify.claims.legs import nearest_leg
from pentapod.verify.replay.claim import MM, TOLERATED, Claim, Finding, Idle
from pentapod.verify.replay.replay import Replay

SOFTER = 0.2
"""By which legs may be softer than a machine's file says, for what is told of compensation."""


def force(replay: Replay) -> Finding | Idle:
    """Judge the force that each drive needs at the rows against what it has there."""
    if not replay.machine.drive_forces.limited:
        return Idle("the machine says nothing of the forces of its drives")
    forces = replay.forces
    row, leg = np.unravel_index(int((forces.asked / forces.available).argmax()), forces.asked.shape)
    value, bound = float(forces.asked[row, leg]), float(forces.available[row, leg])
    method = f"inverse dynamics of the machine's masses at the rows, {_parts(replay)}; {TOLERATED}"
    return Finding.at_most(value, bound, 1.0, "N", replay.place(2 * int(row)), nearest_leg(int(leg), method))


def continuous_force(replay: Replay) -> Finding | Idle:
    """Judge the root mean square of each drive's force over the whole program."""
    limit = replay.machine.drive_forces.continuous_force
    if not np.isfinite(limit).any():
        return Idle("the machine says nothing of the force that its drives bear all the time")
    forces = replay.forces
    mean = np.sqrt(np.square(np.abs(forces.push) + forces.cutting).mean(axis=0))
    leg = int(np.argmax(mean / limit))
    row = int(np.argmax(np.abs(forces.push[:, leg]) + forces.cutting[:, leg]))
    method = f"root mean square over all rows of the force by the machine's masses, {_parts(replay)}; {TOLERATED}"
    where = replay.place(2 * row)
    return Finding.at_most(float(mean[leg]), float(limit[leg]), 1.0, "N", where, nearest_leg(leg, method))


def _parts(replay: Replay) -> str:
    cutting = replay.machine.cutting_force
    return "with friction" + (f" and {cutting:g} N in any direction on the tip on cuts" if cutting else "")


def deflection(replay: Replay) -> Finding | Idle:
    """Judge how far the tip moves at the rows because the legs yield: to masses, and on cuts to the cutting force.

    The weight that drives compensate for is not counted. A force against the motion for which they compensate counts
    as one that may be missing: where nothing is cut they move the tip.
    """
    machine, bound = replay.machine, replay.specification.deflection
    if not machine.stiffness.given:
        return Idle("the machine says nothing of the stiffness of its legs", unknown=bound is not None)
    if not machine.leg_forces_known:
        return Idle(
            "forces in legs are known only where all end on the tool's line or on rings around it",
            unknown=bound is not None,
        )
    found, force = replay.yielding, machine.cutting_force
    by_masses = np.linalg.norm(found.shift, axis=1)
    by_cutting = np.maximum(force * found.softest * replay.cuts(), replay.pushed) if force else replay.pushed
    total = by_masses + by_cutting
    row = int(total.argmax())
    shift, way, value = found.shift[row], found.ways[row], float(total[row])
    way = shift + by_cutting[row] * (way if shift @ way >= 0.0 else -way)
    told = ", ".join(f"{x:+.2f}" for x in way / max(float(np.linalg.norm(way)), float(np.finfo(float).tiny)))
    masses = "weight and acceleration" if replay.compensated_by is None else "acceleration"
    process = replay.program.process_force
    cutting = f"{force:g} N in any direction on cuts"
    if process is not None:
        cutting = (
            f"{process.newtons:g} N against the motion on cuts: drives compensate for it, and move the tip without it"
        )
    method = (
        f"springs of legs and joints, first order, at the rows: {1e6 * by_masses[row]:.3g} µm by {masses} there, "
        f"{1e6 * by_cutting[row]:.3g} µm at most by {cutting}; towards about ({told}) in the machine's frame; "
        f"{masses} alone: {1e6 * by_masses.min():.3g} to {1e6 * by_masses.max():.3g} µm"
    )
    if replay.compensated_by is not None:
        most = 1e6 * float(replay.sag.max())
        method += (
            f"; drives compensate for the weight{_process(replay)}, which moves the tip by up to {most:.3g} µm: legs "
            f"that are {SOFTER:.0%} softer than the machine says leave {most * SOFTER / (1.0 - SOFTER):.3g} µm of it"
        )
    if bound is None:
        return Finding(True, MM * value, None, "mm", replay.place(2 * row), f"no bound is asked for; {method}")
    return Finding.at_most(value, bound, MM, "mm", replay.place(2 * row), f"{method}; {TOLERATED}")


def _process(replay: Replay) -> str:
    force = replay.program.process_force
    return "" if force is None else f" and {force.newtons:g} N against the motion on cuts"


CLAIMS = (
    Claim("leg forces", force),
    Claim("continuous leg forces", continuous_force),
    Claim("deflection", deflection),
)
