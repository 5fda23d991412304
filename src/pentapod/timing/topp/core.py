"""The compiled TOPP-RA engine: both passes over one range of stages, and failures in words."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.timing.topp.core_kernels import controllable, fastest_forward
from pentapod.timing.topp.stages import NOT_CONTROLLABLE, TOO_FAST_END, UNBOUNDED, Failure, Stages, admitted


def solve(stages: Stages, x_start: float, x_end: float) -> Floats | Failure:
    """Return the largest x (N + 1,), or why there is none."""
    speeds = backward(stages, (x_end, x_end))
    if isinstance(speeds, Failure):
        return speeds
    low, high = speeds
    start = admitted(x_start, float(low[0]), float(high[0]))
    return start if isinstance(start, Failure) else forward(stages, low, high, start)


def backward(stages: Stages, end: tuple[float, float]) -> tuple[Floats, Floats] | Failure:
    """Return the least and largest controllable x (N + 1,), from those at the last gridpoint."""
    low, high = np.empty(len(stages)), np.empty(len(stages))
    low[-1], high[-1] = end
    if end[0] > stages.ceiling[-1]:
        return Failure(len(stages) - 1, TOO_FAST_END)
    conflict = np.zeros(2, np.int64)
    at = controllable(
        stages.s,
        stages.first,
        stages.second,
        stages.middle,
        int(len(stages.offset) > 1),
        stages.ceiling,
        low,
        high,
        conflict,
    )
    if at < 0:
        return low, high
    if conflict[0] == -2:
        return Failure(at, UNBOUNDED)
    return Failure(at, NOT_CONTROLLABLE, tuple(sorted({int(row) // 2 for row in conflict if row >= 0})))


def forward(stages: Stages, low: Floats, high: Floats, x_start: float) -> Floats:
    """Return the largest x (N + 1,) from x_start, within the controllable speeds."""
    x = np.empty(len(stages))
    x[0] = x_start
    fastest_forward(stages.s, stages.first, stages.second, stages.middle, int(len(stages.offset) > 1), low, high, x)
    return x
