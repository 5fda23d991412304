"""Claims on the limits of the tool, where there are any: tip acceleration and jerk, axis velocity and acceleration."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.geometry.interpolant import Interpolant, largest_length
from pentapod.verify.replay.claim import DEG, MM, TOLERATED, Claim, Finding, Idle
from pentapod.verify.replay.replay import Replay


def acceleration(replay: Replay) -> Finding:
    """Judge the tip's acceleration."""
    limit = replay.machine.tool_limits.max_tip_acceleration
    largest = np.linalg.norm(_tip(replay).second, axis=1)
    return _below(replay, largest, limit, MM, "mm/s²", "second derivative of the interpolated tips at the rows")


def jerk(replay: Replay) -> Finding:
    """Judge the tip's jerk."""
    limit = replay.machine.tool_limits.max_tip_jerk
    largest = _tip(replay).jerk_lengths
    return _below(replay, largest, limit, MM, "mm/s³", "third derivative of the interpolated tips between the rows")


def axis_velocity(replay: Replay) -> Finding:
    """Judge the angular velocity of the tool axis."""
    limit = replay.machine.tool_limits.max_axis_velocity
    value, row = largest_length(_axis(replay).steps)
    return _finding(replay, value, row, limit, DEG, "deg/s", "largest rate of the interpolated tool axes at any time")


def axis_acceleration(replay: Replay) -> Finding:
    """Judge the angular acceleration of the tool axis."""
    limit = replay.machine.tool_limits.max_axis_acceleration
    largest = _axis(replay).turn_accelerations
    return _below(
        replay, largest, limit, DEG, "deg/s²", "angular acceleration of the interpolated tool axes at the rows"
    )


def _tip(replay: Replay) -> Interpolant:
    """Return the interpolant of the tips at the rows (N, 3), machine frame, of the kind that the controller uses."""
    position, direction = replay.pose
    return _joined(replay, position[::2] + replay.machine.tool_length * direction[::2])


def _axis(replay: Replay) -> Interpolant:
    """Return the interpolant of the tool's directions at the rows (N, 3), likewise."""
    return _joined(replay, replay.pose[1][::2])


def _joined(replay: Replay, rows: Floats) -> Interpolant:
    return Interpolant.through(rows, replay.program.period, replay.program.interpolation)


def _below(replay: Replay, values: Floats, limit: float, scale: float, unit: str, method: str) -> Finding:
    """Judge the largest of values (N or N − 1,), one for each row, against a limit, both SI."""
    row = int(np.argmax(values))
    return _finding(replay, float(values[row]), row, limit, scale, unit, method)


def _finding(replay: Replay, value: float, row: int, limit: float, scale: float, unit: str, method: str) -> Finding:
    return Finding.at_most(value, limit, scale, unit, replay.place(2 * row), f"{method}; {TOLERATED}")


def _where_limited(replay: Replay, *, name: str, judge: Callable[[Replay], Finding]) -> Finding | Idle:
    return judge(replay) if name in replay.machine.tool_limits.given() else Idle("neither machine nor job has a limit")


CLAIMS = tuple(
    Claim(claim, partial(_where_limited, name=name, judge=judge))
    for claim, name, judge in (
        ("tip acceleration", "max_tip_acceleration", acceleration),
        ("tip jerk", "max_tip_jerk", jerk),
        ("axis velocity", "max_axis_velocity", axis_velocity),
        ("axis acceleration", "max_axis_acceleration", axis_acceleration),
    )
)
