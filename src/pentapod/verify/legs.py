"""Claims about each leg: length, rate, acceleration, jerk. Exact on the interpolant."""

from __future__ import annotations

import numpy as np

from pentapod.arrays import Floats
from pentapod.program.resolution import QUANTA_PER_M
from pentapod.verify.claim import ALLOWANCE, Claim, Finding
from pentapod.verify.replay import Replay

_EXACT = "exact extrema of the controller's polynomials, rows and between"

JERK_ALLOWANCE = 0.05
"""Relative allowance on leg jerks: where the jerk of the motion steps, the spline through its setpoints overshoots."""

# What rounding each row by half a quantum can do to third differences, 8 / 2, and to the spline's third derivative,
# 24 / 2 (rows rounded up and down in turn), in quanta by the period cubed.
_ROUNDED = {1: 4.0, 3: 12.0}


def shortest(replay: Replay) -> Finding:
    """Judge that no leg gets shorter than its stroke allows."""
    low, limit = replay.motion.ranges[0], replay.machine.legs.min_length
    interval, leg = np.unravel_index(int(np.argmin(low - limit)), low.shape)
    value, bound = float(low[interval, leg]), float(limit[leg])
    return _finding(replay, value >= bound, (value, bound, "mm"), (2 * int(interval), int(leg)), _EXACT)


def longest(replay: Replay) -> Finding:
    """Judge that no leg gets longer than its stroke allows."""
    high, limit = replay.motion.ranges[1], replay.machine.legs.max_length
    interval, leg = np.unravel_index(int(np.argmax(high - limit)), high.shape)
    value, bound = float(high[interval, leg]), float(limit[leg])
    return _finding(replay, value <= bound, (value, bound, "mm"), (2 * int(interval), int(leg)), _EXACT)


def rate(replay: Replay) -> Finding:
    """Judge the speed of every leg."""
    return _below(replay, replay.motion.rates, replay.machine.legs.max_velocity, "mm/s", _EXACT)


def acceleration(replay: Replay) -> Finding:
    """Judge the acceleration of every leg, with rest before the first row and after the last."""
    method = (
        "second difference of the rows by the period squared, from rest and to rest"
        if replay.motion.degree == 1
        else "second derivative of the spline, linear between the rows: exact"
    )
    limit = replay.machine.legs.max_acceleration
    return _below(replay, replay.motion.accelerations, limit, "mm/s²", method)


def jerk(replay: Replay) -> Finding:
    """Judge the jerk of every leg, with rest before the first row and after the last."""
    motion, limit = replay.motion, replay.machine.legs.max_jerk
    rounding = _ROUNDED[motion.degree] / QUANTA_PER_M / motion.period**3
    interval, leg = np.unravel_index(int(np.argmax(motion.jerks / limit)), motion.jerks.shape)
    value, bound = float(motion.jerks[interval, leg]), float(limit[leg])
    method = (
        "third difference of the rows by the period cubed, in place of the impulses that lines between rows have; "
        if motion.degree == 1
        else "third derivative of the spline, constant between the rows: exact; "
    )
    method += (
        "a step of acceleration at either end counts over one period; "
        f"{JERK_ALLOWANCE:.0%} allowed, and {1e3 * rounding:.3g} mm/s³ for the rounding of the rows"
    )
    passed = value <= bound * (1.0 + JERK_ALLOWANCE) + rounding
    return _finding(replay, passed, (value, bound, "mm/s³"), (2 * int(interval), int(leg)), method)


def _below(replay: Replay, values: Floats, limit: Floats, unit: str, method: str) -> Finding:
    """Judge values (N or N − 1, 5) against limits (5,), both SI."""
    row, leg = np.unravel_index(int(np.argmax(values / limit)), values.shape)
    value, bound = float(values[row, leg]), float(limit[leg])
    passed = value <= bound * (1.0 + ALLOWANCE)
    method += f"; {ALLOWANCE:.1%} allowed"
    return _finding(replay, passed, (value, bound, unit), (2 * int(row), int(leg)), method)


def _finding(
    replay: Replay, passed: bool, found: tuple[float, float, str], at: tuple[int, int], method: str
) -> Finding:
    """Return the finding on (value, bound, unit), lengths in metres, at (sample, leg)."""
    (value, bound, unit), (sample, leg) = found, at
    method = f"leg {leg + 1} is closest to its limit; {method}"
    return Finding(passed, 1e3 * value, 1e3 * bound, unit, replay.place(sample), method)


CLAIMS = (
    Claim("legs not too short", shortest, needs_pose=False),
    Claim("legs not too long", longest, needs_pose=False),
    Claim("leg rates", rate, needs_pose=False),
    Claim("leg accelerations", acceleration, needs_pose=False),
    Claim("leg jerks", jerk, needs_pose=False),
)
