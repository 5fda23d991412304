"""Claims about the tool's own motion, for machines and jobs that limit it: tip acceleration and jerk, axis turning."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.interpolant import Interpolant, largest_length
from pentapod.verify.replay.claim import ALLOWANCE, MM, Claim, Finding, Idle, with_allowance
from pentapod.verify.replay.replay import Replay

_DEG = 180.0 / np.pi  # in a radian


def acceleration(replay: Replay) -> Finding:
    """Judge the tip's acceleration."""
    limit = replay.machine.tool_limits.max_tip_acceleration
    largest = _largest(np.linalg.norm(_tip(replay).second, axis=1))
    method = f"second derivative of what joins the program's tips, at its rows; {ALLOWANCE:.1%} allowed"
    return _below(replay, largest, limit, (MM, "mm/s²", with_allowance(limit)), method)


def jerk(replay: Replay) -> Finding:
    """Judge the tip's jerk."""
    limit = replay.machine.tool_limits.max_tip_jerk
    method = f"third derivative of what joins the program's tips, between its rows; {ALLOWANCE:.1%} allowed"
    allowed = with_allowance(limit)
    return _below(replay, _largest(_tip(replay).jerk_lengths), limit, (MM, "mm/s³", allowed), method)


def axis_velocity(replay: Replay) -> Finding:
    """Judge how fast the tool axis turns."""
    limit = replay.machine.tool_limits.max_axis_velocity
    method = f"largest rate of what joins the program's tool axes, rows and between; {ALLOWANCE:.1%} allowed"
    return _below(replay, largest_length(_axis(replay).steps), limit, (_DEG, "deg/s", with_allowance(limit)), method)


def axis_acceleration(replay: Replay) -> Finding:
    """Judge the angular acceleration of the tool axis."""
    limit = replay.machine.tool_limits.max_axis_acceleration
    method = f"angular acceleration of what joins the program's tool axes, at its rows; {ALLOWANCE:.1%} allowed"
    largest = _largest(_axis(replay).turn_accelerations)
    return _below(replay, largest, limit, (_DEG, "deg/s²", with_allowance(limit)), method)


def _tip(replay: Replay) -> Interpolant:
    """Return what joins the tips at the rows (N, 3) as the controller joins the legs, machine frame."""
    position, direction = replay.pose
    return _joined(replay, position[::2] + replay.machine.tool_length * direction[::2])


def _axis(replay: Replay) -> Interpolant:
    """Return what joins the tool's directions at the rows (N, 3), likewise."""
    return _joined(replay, replay.pose[1][::2])


def _joined(replay: Replay, rows: Floats) -> Interpolant:
    return Interpolant.through(rows, replay.program.period, replay.program.interpolation)


def _largest(values: Floats) -> tuple[float, int]:
    """Return the largest of values (N or N − 1,) and its row."""
    row = int(np.argmax(values))
    return float(values[row]), row


def _below(
    replay: Replay, found: tuple[float, int], limit: float, told: tuple[float, str, float], method: str
) -> Finding:
    """Judge a value and its row against a limit; told: factor and unit in which to tell both, and what is allowed."""
    (value, row), (factor, unit, allowed) = found, told
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
