"""Where the spline of a jerk-limited law has its knots: close where there is something to find, few where not."""

from __future__ import annotations

import numpy as np

from pentapod.arrays import Bools, Floats
from pentapod.timing.jerk_rows import JerkRows

_KNOTS_PER_RAMP = 6
_LEAST_KNOTS = 64
_GROWTH = 1.5

_CALM_MARGIN, _CALM_GROWTH, _CALM_MOST = 3.0, 0.3, 12.0
"""Knots become fewer from so many ramps on inside a stretch of constant speed, how fast with the time, and how few."""

_CALM_SHARE = 0.5


def law_knots(s: Floats, x: Floats, rows: JerkRows, marks: Floats, begin: float, end: float) -> Floats:
    """Return inner knots (K,) from begin to end: even in the time of the law x, at marks, ever closer to the rests.

    There is a rest where the spline does not reach to the path's end.

    Where that law keeps its speed and no other limit is near there is little to find: knots are few.
    """
    speed = np.sqrt(x)
    steps = 2.0 * np.diff(s) / (speed[:-1] + speed[1:])
    with np.errstate(divide="ignore", invalid="ignore"):
        ramps = 2.0 * np.abs(rows.jerks[:, :, 2]).max(axis=1) / np.abs(rows.first).max(axis=1)
    ramp = float(np.median(ramps[np.isfinite(ramps) & (ramps > 0.0)]))
    calm = _calm(x, rows)
    room = _seconds_to_others(steps, calm) - _CALM_MARGIN * ramp
    every = min(ramp / _KNOTS_PER_RAMP, float(steps.sum()) / _LEAST_KNOTS)
    wide = every * np.clip(1.0 + _CALM_GROWTH * room / every, 1.0, _CALM_MOST)
    number = np.concatenate([[0.0], np.cumsum(2.0 * steps / (wide[:-1] + wide[1:]))])
    even = np.interp(np.linspace(0.0, number[-1], int(np.ceil(number[-1])) + 1), number, s)
    marks = marks[np.interp(marks, s, wide) < _CALM_MOST * every]
    gap = np.interp(s, (even[1:] + even[:-1]) / 2.0, np.diff(even))
    knots = np.sort(np.concatenate([even, marks]))
    length = end - begin
    near = begin * _GROWTH ** np.arange(1, 200)
    far = (s[-1] - end) * _GROWTH ** np.arange(1, 200)
    near = near[(near > 0.0) & (near * (1.0 - 1.0 / _GROWTH) < np.interp(near, s, gap)) & (near < 0.45 * length)]
    far = far[(far > 0.0) & (far * (1.0 - 1.0 / _GROWTH) < np.interp(s[-1] - far, s, gap)) & (far < 0.45 * length)]
    low = near[-1] if len(near) else begin
    high = s[-1] - (far[-1] if len(far) else s[-1] - end)
    knots = np.concatenate([[begin], near, knots[(knots > low) & (knots < high)], (s[-1] - far)[::-1], [end]])
    # Knots much closer than their neighbourhood asks for add rows and no freedom.
    least = 0.2 * np.interp(knots, s, gap)
    least = np.minimum(least, 0.2 * knots) if begin > 0.0 else least
    least = np.minimum(least, 0.2 * (s[-1] - knots)) if end < s[-1] else least
    kept = [begin]
    for knot, room in zip(knots[1:-1].tolist(), least[1:-1].tolist(), strict=True):
        if knot - kept[-1] > room:
            kept.append(knot)
    while len(kept) > 1 and end - kept[-1] < least[-2]:
        kept.pop()
    return np.array([*kept, end])


def _calm(x: Floats, rows: JerkRows) -> Bools:
    """Return at which gridpoints (N + 1,) the law x keeps its speed, far from the limits of acceleration and jerk."""
    steady = np.abs(np.diff(x)) <= 1e-6 * x[:-1]
    use = np.maximum(
        np.abs(rows.second * x[:, None] - rows.offset).max(axis=1),
        np.abs(rows.jerks[:, :, 0]).max(axis=1) * x**1.5,
    )
    return np.append(steady, False) & np.append(False, steady) & (use < _CALM_SHARE)


def _seconds_to_others(steps: Floats, calm: Bools) -> Floats:
    """Return how far (N + 1,) in seconds each gridpoint is from the nearest that is not calm; steps (N,) in seconds."""
    times = np.concatenate([[0.0], np.cumsum(steps)])
    since = times - np.maximum.accumulate(np.where(calm, 0.0, times))
    until = np.minimum.accumulate(np.where(calm, times[-1], times)[::-1])[::-1] - times
    return np.minimum(since, until)
