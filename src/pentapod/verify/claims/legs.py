"""Claims about each leg: length, rate, acceleration, jerk. Exact on the interpolant."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.verify.replay.claim import ALLOWANCE, MM, Claim, Finding, with_allowance
from pentapod.verify.replay.interval_bounds import RunningMaximum
from pentapod.verify.replay.replay import Replay

_EXACT = "exact extrema of the controller's polynomials, rows and between"


def shortest(replay: Replay) -> Finding:
    """Judge that no leg gets shorter than its stroke allows."""
    found, limit = replay.interval_bounds.shortest, replay.machine.legs.min_length
    leg = int(np.argmin(-found.values - limit))
    value, bound = -float(found.values[leg]), float(limit[leg])
    return _finding(replay, value >= bound, (value, bound, "mm"), (int(found.at[leg]), leg), _EXACT)


def longest(replay: Replay) -> Finding:
    """Judge that no leg gets longer than its stroke allows."""
    found, limit = replay.interval_bounds.longest, replay.machine.legs.max_length
    leg = int(np.argmax(found.values - limit))
    value, bound = float(found.values[leg]), float(limit[leg])
    return _finding(replay, value <= bound, (value, bound, "mm"), (int(found.at[leg]), leg), _EXACT)


def rate(replay: Replay) -> Finding:
    """Judge the speed of every leg."""
    return _below(replay, replay.interval_bounds.rates, replay.machine.legs.max_velocity, "mm/s", _EXACT)


def acceleration(replay: Replay) -> Finding:
    """Judge the acceleration of every leg, with rest before the first row and after the last."""
    method = (
        "second difference of the rows by the period squared, from rest and to rest: exact"
        if replay.program.interpolation == "linear"
        else "second derivative of the spline, linear between the rows: exact"
    )
    limit = replay.machine.legs.max_acceleration
    return _below(replay, replay.interval_bounds.accelerations, limit, "mm/s²", method)


def jerk(replay: Replay) -> Finding:
    """Judge the jerk of every leg, with rest before the first row and after the last."""
    method = (
        "third difference of the rows by the period cubed, in place of the impulses that lines between rows have; "
        if replay.program.interpolation == "linear"
        else "third derivative of the spline, constant between the rows: exact; "
    )
    method += "a step of acceleration at either end counts over one period"
    return _below(replay, replay.interval_bounds.jerks, replay.machine.legs.max_jerk, "mm/s³", method)


def _below(replay: Replay, found: RunningMaximum, limit: Floats, unit: str, method: str) -> Finding:
    """Judge the largest of each leg against limits (n_legs,), both SI."""
    leg = int(np.argmax(found.values / limit))
    value, bound = float(found.values[leg]), float(limit[leg])
    allowed = with_allowance(bound)
    method += f"; {ALLOWANCE:.1%} allowed"
    return _finding(replay, value <= allowed, (value, bound, unit), (int(found.at[leg]), leg), method, allowed)


def _finding(
    replay: Replay,
    passed: bool,
    found: tuple[float, float, str],
    at: tuple[int, int],
    method: str,
    allowed: float | None = None,
) -> Finding:
    """Return the finding on (value, bound, unit), lengths in metres as in allowed, at (row, leg)."""
    (value, bound, unit), (row, leg) = found, at
    allowed = None if allowed is None else MM * allowed
    method = f"leg {leg + 1} is closest to its limit; {method}"
    return Finding(passed, MM * value, MM * bound, unit, replay.place(2 * row), method, allowed)


CLAIMS = (
    Claim("legs not too short", shortest, needs_pose=False),
    Claim("legs not too long", longest, needs_pose=False),
    Claim("leg rates", rate, needs_pose=False),
    Claim("leg accelerations", acceleration, needs_pose=False),
    Claim("leg jerks", jerk, needs_pose=False),
)
