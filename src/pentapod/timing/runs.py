"""The two passes without a compiler where most gridpoints run at their ceilings: the rest is short runs, side by side.

A stage that leads from ceiling to ceiling needs no pass. From each one that does not, the backward pass runs until it
is at the ceiling again, or meets what another run has found; the forward pass likewise, below what the backward pass
left. All runs take their steps together.
"""

from __future__ import annotations

import numpy as np

from pentapod.arrays import Bools, Floats, Ints
from pentapod.timing.stage_rows import StageRows, least_reach, right_root
from pentapod.timing.stages import Failure, admitted

_LONGEST = 0.1
"""Steps as a share of the gridpoints, beyond which runs are too long to gain by."""

_LEAST = 500


def by_runs(rows: StageRows, x_start: float) -> Floats | Failure | None:
    """Return the largest x (N,) from x_start to a rest, why there is none, or None where runs do not do."""
    distinct = np.append(True, rows.twice[:-1] > 0.0)
    if not distinct.all():  # where a gridpoint comes twice x stays: both sides' rows and ceilings hold there
        stages = np.append(np.flatnonzero(distinct[1:]), len(distinct) - 1)
        ceiling = np.minimum.reduceat(rows.ceiling, np.flatnonzero(distinct))
        once = StageRows(rows.lows[stages], rows.highs[stages], rows.slopes[stages], rows.twice[stages], ceiling)
        x = by_runs(once, x_start)
        return x[np.cumsum(distinct) - 1] if isinstance(x, np.ndarray) else None
    if len(distinct) < 2 or not np.isfinite(rows.ceiling).all():
        return None
    most = max(_LEAST, int(_LONGEST * len(rows.ceiling)))
    high = _backward(rows, most)
    if high is None:
        return None
    start = admitted(x_start, 0.0, float(high[0]))
    return start if isinstance(start, Failure) else _forward(rows, high, start, most)


def _backward(rows: StageRows, most: int) -> Floats | None:
    """Return the largest controllable x (N,), None where runs are too long or end."""
    high = rows.ceiling.copy()
    high[-1] = 0.0
    here, u = high[:-1], np.diff(high) / rows.twice[:-1]
    t = rows.slopes[:-1, :-1] * here[:, None]
    low, top = (rows.lows[:-1, :-1] - t).max(axis=1), (rows.highs[:-1, :-1] - t).min(axis=1)
    unfit = ~((low <= u) & (u <= top))
    todo = unfit.copy()
    at = np.flatnonzero(unfit & ~np.append(unfit[1:], False))
    for _ in range(most):
        if not len(at):
            return high
        x = _before(rows, at, high[at + 1])
        if x is None:
            return None
        lower = x < high[at]
        high[at], todo[at] = np.minimum(x, high[at]), False
        at = at[(at > 0) & (lower | todo[at - 1])] - 1
    return None


def _before(rows: StageRows, at: Ints, after: Floats) -> Floats | None:
    """Return the largest x (w,) at stages `at` (w,) from which `after` (w,) or less can be reached."""
    lows, highs, slopes, twice = rows.lows[at].T, rows.highs[at].T, rows.slopes[at].T, rows.twice[at]
    lows[-1], highs[-1] = 0.0, after / twice
    x = rows.ceiling[at]
    far = ~(x <= 1e3 * after)
    if far.any():
        x[far] = np.minimum(x[far], least_reach(lows[:, far], highs[:, far], slopes[:, far]))
    x, lost = right_root(lows, highs, slopes, x)
    return None if lost.any() else x


def _forward(rows: StageRows, high: Floats, x_start: float, most: int) -> Floats | None:
    """Return the largest x (N,) from x_start below `high` (N,), None where runs are too long."""
    x, every = high.copy(), np.arange(len(high) - 1)
    x[0] = x_start
    unfit: Bools = _after(rows, every, x[:-1]) < x[1:]
    todo = unfit.copy()
    at = np.flatnonzero(unfit & ~np.append(False, unfit[:-1]))
    for _ in range(most):
        if not len(at):
            return x
        following = np.minimum(_after(rows, at, x[at]), high[at + 1])
        # What comes from further back knows better: it is what a single pass would have, greater or less.
        other = following != x[at + 1]
        x[at + 1], todo[at] = following, False
        at = at[at < len(todo) - 1]
        at = at[other[: len(at)] | todo[at + 1]] + 1
    return None


def _after(rows: StageRows, at: Ints, x: Floats) -> Floats:
    """Return the largest x (w,) at the ends of stages `at` (w,) that begin with x (w,)."""
    u = (rows.highs[at, :-1] - rows.slopes[at, :-1] * x[:, None]).min(axis=1)
    return np.maximum(x + rows.twice[at] * u, 0.0)
