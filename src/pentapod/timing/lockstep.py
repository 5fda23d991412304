"""The two passes without a compiler: the path cut into windows through which NumPy moves side by side.

Towards a rest `by_chains` is done sooner and is tried first. A window starts its pass a lead too early, from rest;
after the lead it has forgotten that. It has for certain where its value at the seam is its neighbour's, bit for bit:
then the windows together are the pass over the whole. Where a seam differs the lead is doubled, until at last there is
one window, which is the whole.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.arrays import Bools, Floats
from pentapod.timing.chains import by_chains
from pentapod.timing.stage_rows import StageRows, clash, least_reach, left_root, right_root
from pentapod.timing.stages import NOT_CONTROLLABLE, TOO_FAST_END, UNBOUNDED, Failure, Stages, admitted

_LEAD = 32
_WIDTH = 6
"""Width of a window in leads: the narrower, the more is done at once, and the more is done twice."""


def solve(stages: Stages, x_start: float, x_end: float) -> Floats | Failure:
    """Return the largest x (N + 1,), or why there is none."""
    if x_end > stages.ceiling[-1]:
        return Failure(len(stages) - 1, TOO_FAST_END)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        rows = StageRows.of(stages)
        x = by_chains(rows, x_start) if x_end == 0.0 else None
        lead = _LEAD
        while x is None:
            x = _Windows.of(rows, lead).solve(x_start, x_end)
            lead *= 2
    return x


@dataclass(frozen=True, eq=False)
class _Windows:
    """The stages of W windows of M gridpoints, M first: each step works on a row of windows.

    A stage's rows are lows − slopes x ≤ u ≤ highs − slopes x, arrays (M, 2R + 1, W): R at its start, R at its end, and
    last the reach of the next gridpoint's speeds, which the backward pass fills in. twice (M, W): 2 Δs, 0 past the
    path's end, where x stays. ceiling (M, W). count: gridpoints of the path.
    """

    lows: Floats
    highs: Floats
    slopes: Floats
    twice: Floats
    ceiling: Floats
    count: int
    lead: int

    @classmethod
    def of(cls, rows: StageRows, lead: int) -> _Windows:
        """Return windows with a lead, or one window where the lead is not small against the path."""
        count = len(rows.ceiling)
        width = _WIDTH * lead if 2 * _WIDTH * lead < count else count
        windows = -(-count // width)
        fills = ((rows.lows, -np.inf), (rows.highs, np.inf), (rows.slopes, 0.0), (rows.twice, 0.0))
        cut = (_cut(y, windows, width, fill) for y, fill in (*fills, (rows.ceiling, np.inf)))
        return cls(*cut, count=count, lead=lead)

    def solve(self, x_start: float, x_end: float) -> Floats | Failure | None:
        """Return the largest x (count,), why there is none, or None where a seam differs."""
        speeds = self._backward(x_end)
        if speeds is None or isinstance(speeds, Failure):
            return speeds
        low, high = speeds
        start = admitted(x_start, float(low[0, 0]), float(high[0, 0]))
        return start if isinstance(start, Failure) else self._forward(low, high, start)

    def _backward(self, x_end: float) -> tuple[Floats, Floats] | Failure | None:
        """Return the controllable speeds (M, W)."""
        low, high = np.empty_like(self.ceiling), np.empty_like(self.ceiling)
        width, windows = self.ceiling.shape
        seam = np.zeros((2, windows))
        seam[:, -1] = x_end
        if windows > 1:  # through the neighbours' first gridpoints
            state = np.zeros((2, windows - 1))
            for k in range(min(self.lead, width - 1) - 1, -1, -1):
                state, _ = self._before(k, slice(1, None), state)
            seam[:, :-1] = state
        state, failure = seam, None
        for k in range(width - 1, -1, -1):
            state, lost = self._before(k, slice(None), state)
            if lost.any() and failure is None:
                failure = self._failure(k, int(np.flatnonzero(lost)[-1]), state)
            low[k], high[k] = state
        if failure is not None:
            return failure
        same = (seam[0, :-1] == low[0, 1:]) & (seam[1, :-1] == high[0, 1:])
        return (low, high) if same.all() else None

    def _before(self, k: int, part: slice, after: Floats) -> tuple[Floats, Bools]:
        """Return least and largest controllable x (2, w) at the stages k of windows, and where there are none."""
        twice, x = self.twice[k, part], self.ceiling[k, part].copy()
        still = twice == 0.0
        low = np.zeros_like(x)
        if still.all():
            x = np.minimum(x, after[1])
            return np.stack([after[0], x]), after[0] > x
        lows, highs, slopes = self.lows[k][:, part], self.highs[k][:, part], self.slopes[k][:, part]
        lows[-1], highs[-1] = after / twice
        # Far above what can be reached, Newton would lose digits.
        far = ~(x <= 1e3 * after[1]) & ~still
        if far.any():
            x[far] = np.minimum(x[far], least_reach(lows[:, far], highs[:, far], slopes[:, far]))
        lost = np.isinf(x) & ~still
        if still.any() or lost.any():
            moving = ~still & ~lost
            x[moving], lost[moving] = right_root(lows[:, moving], highs[:, moving], slopes[:, moving], x[moving])
            x[still], low[still] = np.minimum(x[still], after[1, still]), after[0, still]
            lost |= still & (low > x)
        else:
            x, lost = right_root(lows, highs, slopes, x)
        must = np.flatnonzero((after[0] > 0.0) & ~still & ~lost)
        if len(must):
            low[must], lost[must] = left_root(lows[:, must], highs[:, must], slopes[:, must], x[must])
        return np.stack([low, x]), lost

    def _failure(self, k: int, window: int, state: Floats) -> Failure:
        """Return why there is no controllable x at a stage, of whose window `_before` has returned the state."""
        at = window * len(self.ceiling) + k
        if np.isinf(state[1, window]):
            return Failure(at, UNBOUNDED)
        if self.twice[k, window] == 0.0:
            return Failure(at, NOT_CONTROLLABLE)
        lows, highs, slopes = (y[k][:, window] for y in (self.lows, self.highs, self.slopes))
        return Failure(at, NOT_CONTROLLABLE, clash(lows, highs, slopes, float(self.ceiling[k, window])))

    def _forward(self, low: Floats, high: Floats, x_start: float) -> Floats | None:
        """Return the largest x (count,), None where a seam differs."""
        width, windows = self.ceiling.shape
        x = np.empty_like(high)
        x[0] = x_start
        if windows > 1:  # through the neighbours' last gridpoints
            first = width - min(self.lead, width - 1)
            state = low[first, :-1]
            for k in range(first, width - 1):
                state = self._after(k, slice(None, -1), state, low[k + 1, :-1], high[k + 1, :-1])
            x[0, 1:] = self._after(width - 1, slice(None, -1), state, low[0, 1:], high[0, 1:])
        for k in range(width - 1):
            x[k + 1] = self._after(k, slice(None), x[k], low[k + 1], high[k + 1])
        last = self._after(width - 1, slice(None, -1), x[-1, :-1], low[0, 1:], high[0, 1:])
        return x.T.ravel()[: self.count] if (last == x[0, 1:]).all() else None

    def _after(self, k: int, part: slice, x: Floats, low: Floats, high: Floats) -> Floats:
        """Return the largest x (w,) at the ends of the stages k of windows."""
        twice = self.twice[k, part]
        u = (self.highs[k][:, part] - self.slopes[k][:, part] * x).min(axis=0)
        return np.where(twice > 0.0, np.minimum(np.maximum(x + twice * u, low), high), np.minimum(x, high))


def _cut(y: Floats, windows: int, width: int, fill: float) -> Floats:
    """Return (M, …, W) of y (count, …), filled up past the end."""
    whole = np.full((windows * width, *y.shape[1:]), fill)
    whole[: len(y)] = y
    return np.ascontiguousarray(np.moveaxis(whole.reshape(windows, width, *y.shape[1:]), 0, -1))
