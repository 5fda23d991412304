"""Knot placement for the spline of a jerk-limited law: dense where its curvature changes, sparse elsewhere."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d

from pentapod.base.arrays import Bools, Floats
from pentapod.timing.jerk.part import Part
from pentapod.timing.jerk.rows import JerkRows
from pentapod.timing.limits.limit import share_of_room

_GROWTH = 1.5

_BENT = 0.05
"""Share of a limit that the path's own bend takes by itself, above which its kinks become knots."""

_BESIDE = 2
"""Gridpoints on either side of a kink that count with it."""

_CALM_MARGIN, _CALM_GROWTH, _CALM_MOST = 3.0, 0.3, 12.0
"""Knots become fewer from so many ramps on inside a stretch of constant speed, how fast with the time, and how few."""

_CALM_SHARE = 0.5


def law_knots(part: Part, x: Floats, pushed: float, share: float = 1.0) -> Floats:
    """Return inner knots (K,) even in the time of the law x (N + 1,), at the path's kinks, ever closer to the rests.

    So many for each ramp: the time in which jerk brings the accelerations to the share `pushed` of their limits; but
    no closer in time than the part's least step. Where the law keeps its speed and no other limit is near there is
    little to find: knots are few.
    """
    s, rows = part.s, part.rows
    calm = _calm(x, rows)
    # Where the path's own jerk holds the law far below x, knots are close in the time that it takes there.
    with np.errstate(divide="ignore"):
        x = np.minimum(x, np.abs(rows.jerks[:, :, 0]).max(axis=1) ** (-2.0 / 3.0))
    speed = np.sqrt(x)
    steps = 2.0 * np.diff(s) / (speed[:-1] + speed[1:])
    ramp = pushed * _ramp(rows)
    room = _seconds_to_others(steps, calm) - _CALM_MARGIN * ramp
    every = min(
        max(ramp / (share * part.options.knots_per_ramp), part.least_step),
        float(steps.sum()) / part.options.least_knots,
    )
    wide = every * np.clip(1.0 + _CALM_GROWTH * room / every, 1.0, _CALM_MOST)
    number = np.concatenate([[0.0], np.cumsum(2.0 * steps / (wide[:-1] + wide[1:]))])
    even = np.interp(np.linspace(0.0, number[-1], int(np.ceil(number[-1])) + 1), number, s)
    marks = _kinks(part, x, np.concatenate([[0.0], np.cumsum(steps)]))
    marks = marks[np.interp(marks, s, wide) < _CALM_MOST * every]
    gap = np.interp(s, (even[1:] + even[:-1]) / 2.0, np.diff(even))
    if len(marks) > 2:
        gap = np.minimum(gap, np.interp(s, (marks[1:] + marks[:-1]) / 2.0, np.diff(marks)))
    return _towards_rests(part, np.sort(np.concatenate([even, marks])), gap)


def _ramp(rows: JerkRows) -> float:
    """Return the seconds in which jerk brings an acceleration to its limit."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ramps = 2.0 * np.abs(rows.jerks[:, :, 2]).max(axis=1) / np.abs(rows.first).max(axis=1)
    return float(np.median(ramps[np.isfinite(ramps) & (ramps > 0.0)]))


def _kinks(part: Part, x: Floats, times: Floats) -> Floats:
    """Return the marks where the path's bend takes part of a limit by the law x, no closer than the least step."""
    use = np.maximum(np.abs(part.rows.jerks[:, :, 0]).max(axis=1) * x**1.5, np.abs(part.rows.second).max(axis=1) * x)
    marks = part.marks[np.interp(part.marks, part.s, maximum_filter1d(use, 2 * _BESIDE + 1)) > _BENT]
    if part.least_step <= 0.0 or not len(marks):
        return marks
    at = np.interp(marks, part.s, times)
    # The first of each least step.
    return marks[np.concatenate([[True], np.diff(np.floor(at / part.least_step)) > 0.0])]


def _towards_rests(part: Part, knots: Floats, gap: Floats) -> Floats:
    """Return the knots between the ends of the spline, ever closer to the rests; gap (N + 1,): how close they are."""
    s, begin, end = part.s, part.begin.join, part.length - part.end.join
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
        share_of_room(rows.second * x[:, None], rows.offset).max(axis=1),
        np.abs(rows.jerks[:, :, 0]).max(axis=1) * x**1.5,
    )
    return np.append(steady, False) & np.append(False, steady) & (use < _CALM_SHARE)


def _seconds_to_others(steps: Floats, calm: Bools) -> Floats:
    """Return how far (N + 1,) in seconds each gridpoint is from the nearest that is not calm; steps (N,) in seconds."""
    times = np.concatenate([[0.0], np.cumsum(steps)])
    since = times - np.maximum.accumulate(np.where(calm, 0.0, times))
    until = np.minimum.accumulate(np.where(calm, times[-1], times)[::-1])[::-1] - times
    return np.minimum(since, until)
