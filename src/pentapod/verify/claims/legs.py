"""Claims about each leg: length, rate, acceleration, jerk, exact on the controller's polynomials, and forces."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.verify.replay.claim import MM, TOLERATED, Claim, Finding, Idle
from pentapod.verify.replay.interval_bounds import RunningMaximum
from pentapod.verify.replay.replay import Replay
from pentapod.verify.verdict.verdict import Place

_NO_FORCES = "the machine says nothing of the forces of its drives"
_EXACT = "exact extreme values of the controller's polynomials, at the rows and between them"


def shortest(replay: Replay) -> Finding:
    """Judge that no leg is shorter than its stroke allows."""
    found, limit = replay.interval_bounds.shortest, replay.machine.legs.min_length
    leg = int(np.argmin(-found.values - limit))
    value, bound = -float(found.values[leg]), float(limit[leg])
    where, method = _place(replay, found, leg), _method(leg, _EXACT)
    return Finding(value >= bound, MM * value, MM * bound, "mm", where, method, at_least=True)


def longest(replay: Replay) -> Finding:
    """Judge that no leg is longer than its stroke allows."""
    found, limit = replay.interval_bounds.longest, replay.machine.legs.max_length
    leg = int(np.argmax(found.values - limit))
    value, bound = float(found.values[leg]), float(limit[leg])
    return Finding(value <= bound, MM * value, MM * bound, "mm", _place(replay, found, leg), _method(leg, _EXACT))


def rate(replay: Replay) -> Finding:
    """Judge the speed of every leg."""
    return _below(replay, replay.interval_bounds.rates, replay.machine.legs.max_velocity, "mm/s", _EXACT)


def acceleration(replay: Replay) -> Finding:
    """Judge the acceleration of every leg, with rest before the first row and after the last."""
    method = (
        "second difference of the rows over the period squared, from rest and to rest: exact"
        if replay.program.interpolation == "linear"
        else "second derivative of the spline, linear between the rows: exact"
    )
    limit = replay.machine.legs.max_acceleration
    return _below(replay, replay.interval_bounds.accelerations, limit, "mm/s²", method)


def jerk(replay: Replay) -> Finding:
    """Judge the jerk of every leg, with rest before the first row and after the last."""
    method = (
        "third difference of the rows over the period cubed, instead of the impulses of linear interpolation; "
        if replay.program.interpolation == "linear"
        else "third derivative of the spline, constant between the rows: exact; "
    )
    method += "a step of acceleration at either end counts over one period"
    return _below(replay, replay.interval_bounds.jerks, replay.machine.legs.max_jerk, "mm/s³", method)


def force(replay: Replay) -> Finding | Idle:
    """Judge the force that each drive needs at the rows against what it has there."""
    if not replay.machine.drive_forces.limited:
        return Idle(_NO_FORCES)
    forces = replay.forces
    row, leg = np.unravel_index(int((forces.asked / forces.available).argmax()), forces.asked.shape)
    value, bound = float(forces.asked[row, leg]), float(forces.available[row, leg])
    method = f"inverse dynamics of the machine's masses at the rows, {_parts(replay)}; {TOLERATED}"
    return Finding.at_most(value, bound, 1.0, "N", replay.place(2 * int(row)), _method(int(leg), method))


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
    return Finding.at_most(float(mean[leg]), float(limit[leg]), 1.0, "N", where, _method(leg, method))


def _parts(replay: Replay) -> str:
    cutting = replay.machine.cutting_force
    return "with friction" + (f" and {cutting:g} N in any direction on the tip on cuts" if cutting else "")


def _below(replay: Replay, found: RunningMaximum, limit: Floats, unit: str, method: str) -> Finding:
    """Judge the largest value of each leg against limits (n_legs,), both SI."""
    leg = int(np.argmax(found.values / limit))
    value, bound = float(found.values[leg]), float(limit[leg])
    return Finding.at_most(value, bound, MM, unit, _place(replay, found, leg), _method(leg, f"{method}; {TOLERATED}"))


def _place(replay: Replay, found: RunningMaximum, leg: int) -> Place:
    return replay.place(2 * int(found.at[leg]))


def _method(leg: int, method: str) -> str:
    return f"leg {leg + 1} is closest to its limit; {method}"


CLAIMS = (
    Claim("legs not too short", shortest, needs_pose=False),
    Claim("legs not too long", longest, needs_pose=False),
    Claim("leg rates", rate, needs_pose=False),
    Claim("leg accelerations", acceleration, needs_pose=False),
    Claim("leg jerks", jerk, needs_pose=False),
    Claim("leg forces", force),
    Claim("continuous leg forces", continuous_force),
)
