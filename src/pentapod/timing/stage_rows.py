"""What each stage asks of u for a given x, as arrays; and the roots that the passes look for, many at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.arrays import Bools, Floats
from pentapod.timing.stages import Stages

_TOUCH = 1e-13
_VAIN = 1e-13
_STEPS = 100


@dataclass(frozen=True, eq=False)
class StageRows:
    """Rows lows − slopes x ≤ u ≤ highs − slopes x of each stage (N, 2R + 1), x that at its start.

    R at its start, R at its end, and last the reach of the next gridpoint's speeds, whose bounds are left open. twice
    (N,): 2 Δs, 0 past the path's end, where x stays. ceiling (N,): of x, by the rows in which u plays no part as well.
    """

    lows: Floats
    highs: Floats
    slopes: Floats
    twice: Floats
    ceiling: Floats

    @classmethod
    def of(cls, stages: Stages) -> StageRows:
        """Return the rows of stages."""
        count = len(stages)
        twice = np.append(2.0 * np.diff(stages.s), 0.0)
        a, b = stages.first, stages.second
        c = np.broadcast_to(stages.offset, a.shape)
        after = np.minimum(np.arange(count) + 1, count - 1)
        f = np.hstack([a, a[after] + twice[:, None] * b[after]])
        g, shift = np.hstack([b, b[after]]), np.hstack([c, c[after]])
        sign = np.where(f < 0.0, -1.0, 1.0)
        f, g, shift = f * sign, g * sign, shift * sign
        # Rows whose u-term is vain bound x alone.
        ceiling = np.array(stages.ceiling)
        vain = f <= (_VAIN * twice / np.maximum(np.maximum(ceiling, ceiling[after]), 1e-300))[:, None]
        alone = np.where(vain & (g != 0.0), (1.0 + shift * np.sign(g)) / np.abs(g), np.inf).min(axis=1)
        ceiling = np.minimum(ceiling, np.where(twice > 0.0, alone, np.inf))
        r = 1.0 / np.where(vain, 1.0, f)
        per = (1.0 / twice)[:, None]
        lows = np.hstack([np.where(vain, -np.inf, (shift - 1.0) * r), np.full_like(per, -np.inf)])
        highs = np.hstack([np.where(vain, np.inf, (shift + 1.0) * r), np.full_like(per, np.inf)])
        slopes = np.hstack([np.where(vain, 0.0, g * r), per])
        return cls(lows, highs, slopes, twice, ceiling)


def least_reach(lows: Floats, highs: Floats, slopes: Floats) -> Floats:
    """Return a bound (w,) of x: that of each row together with the last, which is the reach of the next x."""
    tilt = slopes[:-1] - slopes[-1]
    bound = np.where(tilt > 0.0, highs[:-1] / tilt, (highs[-1] - lows[:-1]) / -tilt)
    return 1.01 * np.where((tilt != 0.0) & np.isfinite(bound), bound, np.inf).min(axis=0)


def clash(lows: Floats, highs: Floats, slopes: Floats, top: float) -> tuple[int, ...]:
    """Return which of the R limits leave no u at any x up to top, of one stage's rows (2R + 1,): one or two of them.

    Where the way that they leave closes, seen from x = 0 on.
    """
    x, pair = 0.0, (-1, -1)
    for _ in range(_STEPS):
        least, most = lows - slopes * x, highs - slopes * x
        below, above = int(least.argmax()), int(most.argmin())
        gap, slope = float(least[below] - most[above]), float(slopes[above] - slopes[below])
        if gap <= 0.0:
            break
        pair = below, above
        if slope >= 0.0 or x - gap / slope > top:
            break
        x -= gap / slope
    limits = len(lows) // 2
    return tuple(sorted({row % limits for row in pair if 0 <= row < 2 * limits}))


def right_root(lows: Floats, highs: Floats, slopes: Floats, cap: Floats) -> tuple[Floats, Bools]:
    """Return the largest x (w,) up to cap that leaves an interval of u, and where there is none."""
    result, bad = cap.copy(), np.zeros(len(cap), dtype=bool)
    at, x = np.arange(len(cap)), cap
    for attempt in range(_STEPS):
        t = slopes * x
        below, above = lows - t, highs - t
        least, most = below.max(axis=0), above.min(axis=0)
        gap, close = least - most, _TOUCH * (np.abs(least) + np.abs(most))
        go = np.flatnonzero((gap > close) | ((gap < -close) & (attempt > 0)))
        if not len(go):
            break
        at, x, gap = at[go], x[go], gap[go]
        lows, highs, slopes = lows[:, go], highs[:, go], slopes[:, go]
        column = np.arange(len(go))
        slope = slopes[above[:, go].argmin(axis=0), column] - slopes[below[:, go].argmax(axis=0), column]
        new = np.where(slope > 0.0, np.minimum(x - gap / slope, cap[at]), np.where(gap > 0.0, -1.0, x))
        result[at] = np.maximum(new, 0.0)
        under = np.flatnonzero(new < 0.0)
        if len(under):
            least, most = lows[:, under].max(axis=0), highs[:, under].min(axis=0)
            bad[at[under]] = least - most > _TOUCH * (np.abs(least) + np.abs(most))
        more = np.flatnonzero((new != x) & (new >= 0.0))
        at, x, lows, highs, slopes = at[more], new[more], lows[:, more], highs[:, more], slopes[:, more]
    return result, bad


def left_root(lows: Floats, highs: Floats, slopes: Floats, top: Floats) -> tuple[Floats, Bools]:
    """Return the least x (w,) up to top that leaves an interval of u, and where there is none."""
    x, bad = np.zeros_like(top), np.zeros(len(top), dtype=bool)
    column = np.arange(len(top))
    for _ in range(_STEPS):
        below, above = lows - slopes * x, highs - slopes * x
        least, most = below.max(axis=0), above.min(axis=0)
        gap = least - most
        go = (gap > _TOUCH * (np.abs(least) + np.abs(most))) & ~bad
        if not go.any():
            break
        slope = slopes[above.argmin(axis=0), column] - slopes[below.argmax(axis=0), column]
        new = np.where(go, np.where(slope < 0.0, x - gap / slope, np.inf), x)
        bad |= ~(new <= top * (1.0 + 1e-12))
        if (bad | (new == x)).all():
            break
        x = np.where(bad, x, new)
    return np.minimum(x, top), bad
