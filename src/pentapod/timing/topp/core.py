"""The compiled TOPP-RA engine: both passes over all stages, and the reasons why there is no profile."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.timing.topp.core_kernels import controllable, fastest_forward
from pentapod.timing.topp.stages import (
    NOT_CONTROLLABLE,
    TOO_FAST,
    TOO_FAST_END,
    TOO_SLOW,
    UNBOUNDED,
    Failure,
    Stages,
)


def solve(stages: Stages, x_start: float, x_end: float) -> Floats | Failure:
    """Return the largest x (N + 1,), or why there is none."""
    low, high, x = (np.empty(len(stages.s)) for _ in range(3))
    if x_end > stages.ceiling[-1]:
        return Failure(len(x) - 1, TOO_FAST_END)
    low[-1], high[-1], conflict = x_end, x_end, np.zeros(2, np.int64)
    rows = stages.s, stages.first, stages.second, -stages.offset, int(len(stages.offset) > 1)
    at = controllable(*rows, stages.ceiling, low, high, conflict)
    if at >= 0:
        if conflict[0] == -2:
            return Failure(at, UNBOUNDED)
        return Failure(at, NOT_CONTROLLABLE, tuple(sorted({int(row) // 2 for row in conflict if row >= 0})))
    # The start's x may be outside the controllable ones by rounding alone.
    if x_start > float(high[0]) * (1.0 + 1e-9):
        return Failure(0, TOO_FAST)
    if x_start < float(low[0]) * (1.0 - 1e-9):
        return Failure(0, TOO_SLOW)
    x[0] = min(max(x_start, float(low[0])), float(high[0]))
    fastest_forward(*rows, low, high, x)
    return x
