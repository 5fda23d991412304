"""Claims about the tool's own motion, for machines and jobs that limit it: tip acceleration and jerk, axis turning."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from pentapod.arrays import Floats
from pentapod.geometry.interpolant import Interpolant, largest_length
from pentapod.program.resolution import QUANTA_PER_M
from pentapod.verify.claim import ALLOWANCE, Claim, Finding, Idle
from pentapod.verify.legs import JERK_ALLOWANCE
from pentapod.verify.replay import Replay

_ROUNDED = {"linear": 40.0, "cubic": 120.0}
"""Quanta by the period cubed that rounding the rows may add to the tip's jerk: tenfold what it may add to a leg's."""


def acceleration(replay: Replay) -> Finding:
    """Judge the tip's acceleration."""
    limit = replay.machine.tool_limits.max_tip_acceleration
    values = np.linalg.norm(_tip(replay).second, axis=1)
    method = f"second derivative of what joins the program's tips, at its rows; {ALLOWANCE:.1%} allowed"
    return _below(replay, values, limit, (1e3, "mm/s²", limit * (1.0 + ALLOWANCE)), method)


def jerk(replay: Replay) -> Finding:
    """Judge the tip's jerk."""
    limit, period = replay.machine.tool_limits.max_tip_jerk, replay.program.period
    rounding = _ROUNDED[replay.program.interpolation] / QUANTA_PER_M / period**3
    method = (
        "third derivative of what joins the program's tips, between its rows; "
        f"{JERK_ALLOWANCE:.0%} allowed, and {1e3 * rounding:.3g} mm/s³ for the rounding of the rows"
    )
    allowed = limit * (1.0 + JERK_ALLOWANCE) + rounding
    return _below(replay, _tip(replay).jerk_lengths, limit, (1e3, "mm/s³", allowed), method)


def axis_velocity(replay: Replay) -> Finding:
    """Judge how fast the tool axis turns."""
    limit = replay.machine.tool_limits.max_axis_velocity
    steps = _axis(replay).steps
    fastest, row = largest_length(steps)
    values = np.where(np.arange(len(steps)) == row, fastest, 0.0)
    method = f"largest rate of what joins the program's tool axes, rows and between; {ALLOWANCE:.1%} allowed"
    return _below(replay, values, limit, (float(np.degrees(1.0)), "deg/s", limit * (1.0 + ALLOWANCE)), method)


def axis_acceleration(replay: Replay) -> Finding:
    """Judge the angular acceleration of the tool axis."""
    limit = replay.machine.tool_limits.max_axis_acceleration
    method = f"angular acceleration of what joins the program's tool axes, at its rows; {ALLOWANCE:.1%} allowed"
    values = _axis(replay).turn_accelerations
    return _below(replay, values, limit, (float(np.degrees(1.0)), "deg/s²", limit * (1.0 + ALLOWANCE)), method)


def _tip(replay: Replay) -> Interpolant:
    """Return what joins the tips at the rows (N, 3) as the controller joins the legs, machine frame."""
    position, direction = replay.pose
    return _joined(replay, position[::2] + replay.machine.tool_length * direction[::2])


def _axis(replay: Replay) -> Interpolant:
    """Return what joins the tool's directions at the rows (N, 3), likewise."""
    return _joined(replay, replay.pose[1][::2])


def _joined(replay: Replay, rows: Floats) -> Interpolant:
    return Interpolant.through(rows, replay.program.period, replay.program.interpolation)


def _below(replay: Replay, values: Floats, limit: float, told: tuple[float, str, float], method: str) -> Finding:
    """Judge values (N or N − 1,) against a limit; told: factor and unit in which to tell them, and what is allowed."""
    factor, unit, allowed = told
    row = int(np.argmax(values))
    value = float(values[row])
    return Finding(
        value <= allowed, factor * value, factor * limit, unit, replay.place(2 * row), method, factor * allowed
    )


def _where_limited(replay: Replay, *, name: str, judge: Callable[[Replay], Finding]) -> Finding | Idle:
    return judge(replay) if name in replay.machine.tool_limits.given() else Idle("neither machine nor job limits it")


CLAIMS = tuple(
    Claim(claim, partial(_where_limited, name=name, judge=judge))
    for claim, name, judge in (
        ("tip acceleration", "max_tip_acceleration", acceleration),
        ("tip jerk", "max_tip_jerk", jerk),
        ("axis velocity", "max_axis_velocity", axis_velocity),
        ("axis acceleration", "max_axis_acceleration", axis_acceleration),
    )
)
