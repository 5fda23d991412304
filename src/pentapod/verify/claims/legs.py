"""Claims about each leg: length, rate, acceleration and jerk, exact on the controller's polynomials."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.verify.replay.claim import MM, TOLERATED, Claim, Finding
from pentapod.verify.replay.interval_bounds import RunningMaximum
from pentapod.verify.replay.replay import Replay
from pentapod.verify.verdict.verdict import Place

_EXACT = "exact extreme values of the controller's polynomials, at the rows and between them"
_TOLD = "; of the lengths that drives are told, which compensate for what the legs yield"


def shortest(replay: Replay) -> Finding:
    """Judge that no leg is shorter than its stroke allows."""
    found, limit = replay.interval_bounds.shortest, replay.machine.legs.min_length
    leg = int(np.argmin(-found.values - limit))
    value, bound = -float(found.values[leg]), float(limit[leg])
    where, method = _place(replay, found, leg), nearest_leg(leg, _of(replay, _EXACT))
    return Finding(value >= bound, MM * value, MM * bound, "mm", where, method, at_least=True)


def longest(replay: Replay) -> Finding:
    """Judge that no leg is longer than its stroke allows."""
    found, limit = replay.interval_bounds.longest, replay.machine.legs.max_length
    leg = int(np.argmax(found.values - limit))
    value, bound = float(found.values[leg]), float(limit[leg])
    where, method = _place(replay, found, leg), nearest_leg(leg, _of(replay, _EXACT))
    return Finding(value <= bound, MM * value, MM * bound, "mm", where, method)


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


def _below(replay: Replay, found: RunningMaximum, limit: Floats, unit: str, method: str) -> Finding:
    """Judge the largest value of each leg against limits (n_legs,), both SI."""
    leg = int(np.argmax(found.values / limit))
    value, bound = float(found.values[leg]), float(limit[leg])
    return Finding.at_most(
        value, bound, MM, unit, _place(replay, found, leg), nearest_leg(leg, f"{_of(replay, method)}; {TOLERATED}")
    )


def _place(replay: Replay, found: RunningMaximum, leg: int) -> Place:
    return replay.place(2 * int(found.at[leg]))


def _of(replay: Replay, method: str) -> str:
    """Return how a claim on the legs was judged, with whose lengths they are where drives are told others."""
    return method if replay.compensated_by is None else f"{method}{_TOLD}"


def nearest_leg(leg: int, method: str) -> str:
    """Return how a claim about all legs was judged, with the leg that is closest to its limit."""
    return f"leg {leg + 1} is closest to its limit; {method}"


CLAIMS = (
    Claim("legs not too short", shortest, needs_pose=False),
    Claim("legs not too long", longest, needs_pose=False),
    Claim("leg rates", rate, needs_pose=False),
    Claim("leg accelerations", acceleration, needs_pose=False),
    Claim("leg jerks", jerk, needs_pose=False),
)
