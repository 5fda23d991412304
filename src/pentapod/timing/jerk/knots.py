"""Knot placement for the spline x(s): even in time, denser at kinks and rests, sparser at constant speed."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d

from pentapod.base.arrays import Bools, Floats, row_maxima
from pentapod.timing.jerk.interval import Interval
from pentapod.timing.jerk.rows import JerkRows
from pentapod.timing.limits.limit import share_of_room


def place_knots(interval: Interval, x: Floats, acceleration: float, share: float = 1.0) -> Floats:
    """Return inner knots (K,), even in the time of the law x (N,), at the path's kinks, and closer towards rests.

    acceleration: largest share of an acceleration limit that the law uses; in a ramp, the time in which jerk reaches
    it, lie `per_ramp` knots, but none closer than the least step. share: of the number of knots. Where the law keeps
    its speed far from other limits, knots are sparse.
    """
    s, rows, options = interval.s, interval.rows, interval.options.knots
    steady = _steady(x, rows, options.steady_share)
    # Where the path's own jerk holds the law far below x, knots are close in the time that it takes there.
    with np.errstate(divide="ignore"):
        x = np.minimum(x, row_maxima(np.abs(rows.jerks[:, :, 0])) ** (-2.0 / 3.0))
    speed = np.sqrt(x)
    steps = 2.0 * np.diff(s) / (speed[:-1] + speed[1:])
    times = np.concatenate([[0.0], np.cumsum(steps)])
    ramp = acceleration * _ramp_time(rows)
    inside = _seconds_inside(times, steady) - options.steady_margin * ramp
    usual = min(
        max(ramp / (share * options.per_ramp), interval.least_step),
        float(steps.sum()) / options.least,
    )
    wide = usual * np.clip(1.0 + options.steady_growth * inside / usual, 1.0, options.steady_most)
    number = np.concatenate([[0.0], np.cumsum(2.0 * steps / (wide[:-1] + wide[1:]))])
    even = np.interp(np.linspace(0.0, number[-1], int(np.ceil(number[-1])) + 1), number, s)
    kinks = _active_kinks(interval, x, times)
    kinks = kinks[np.interp(kinks, s, wide) < options.steady_most * usual]
    gap = np.interp(s, (even[1:] + even[:-1]) / 2.0, np.diff(even))
    if len(kinks) > 2:
        gap = np.minimum(gap, np.interp(s, (kinks[1:] + kinks[:-1]) / 2.0, np.diff(kinks)))
    return _towards_rests(interval, np.sort(np.concatenate([even, kinks])), gap)


def _ramp_time(rows: JerkRows) -> float:
    """Return the median time in seconds in which the jerk limit brings an acceleration to its limit."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ramps = 2.0 * row_maxima(np.abs(rows.jerks[:, :, 2])) / row_maxima(np.abs(rows.first))
    return float(np.median(ramps[np.isfinite(ramps) & (ramps > 0.0)]))


def _active_kinks(interval: Interval, x: Floats, times: Floats) -> Floats:
    """Return the kinks where the path's curvature takes part of a limit at the law x, no closer than the least step."""
    rows, options = interval.rows, interval.options.knots
    use = np.maximum(row_maxima(np.abs(rows.jerks[:, :, 0])) * x**1.5, row_maxima(np.abs(rows.second)) * x)
    use = maximum_filter1d(use, 2 * options.kink_reach + 1)
    kinks = interval.kinks[np.interp(interval.kinks, interval.s, use) > options.kink_share]
    if interval.least_step <= 0.0 or not len(kinks):
        return kinks
    at = np.interp(kinks, interval.s, times)
    return kinks[np.concatenate([[True], np.diff(np.floor(at / interval.least_step)) > 0.0])]


def _towards_rests(interval: Interval, knots: Floats, gap: Floats) -> Floats:
    """Return the knots between the ends of the spline, ever closer to the rests; gap (N,): their usual distance."""
    s, begin, end = interval.s, interval.begin.join, interval.length - interval.end.join
    options = interval.options.knots
    growth, length = options.rest_growth, end - begin
    near = begin * growth ** np.arange(1, 200)
    far = (s[-1] - end) * growth ** np.arange(1, 200)
    near = near[(near > 0.0) & (near * (1.0 - 1.0 / growth) < np.interp(near, s, gap)) & (near < 0.45 * length)]
    far = far[(far > 0.0) & (far * (1.0 - 1.0 / growth) < np.interp(s[-1] - far, s, gap)) & (far < 0.45 * length)]
    low = near[-1] if len(near) else begin
    high = s[-1] - (far[-1] if len(far) else s[-1] - end)
    knots = np.concatenate([[begin], near, knots[(knots > low) & (knots < high)], (s[-1] - far)[::-1], [end]])
    # Knots much closer than their neighbourhood asks for add rows and no freedom.
    least = options.min_gap * np.interp(knots, s, gap)
    least = np.minimum(least, options.min_gap * knots) if begin > 0.0 else least
    least = np.minimum(least, options.min_gap * (s[-1] - knots)) if end < s[-1] else least
    kept = [begin]
    for knot, room in zip(knots[1:-1].tolist(), least[1:-1].tolist(), strict=True):
        if knot - kept[-1] > room:
            kept.append(knot)
    while len(kept) > 1 and end - kept[-1] < least[-2]:
        kept.pop()
    return np.array([*kept, end])


def _steady(x: Floats, rows: JerkRows, share: float) -> Bools:
    """Return at which gridpoints (N,) the law x keeps its speed and uses less than a share of the other limits."""
    constant = np.abs(np.diff(x)) <= 1e-6 * x[:-1]
    use = np.maximum(
        row_maxima(share_of_room(rows.second * x[:, None], rows.offset)),
        row_maxima(np.abs(rows.jerks[:, :, 0])) * x**1.5,
    )
    return np.append(constant, False) & np.append(False, constant) & (use < share)


def _seconds_inside(times: Floats, steady: Bools) -> Floats:
    """Return the seconds (N,) from each gridpoint, passed at `times` (N,), to the nearest that is not steady."""
    since = times - np.maximum.accumulate(np.where(steady, 0.0, times))
    until = np.minimum.accumulate(np.where(steady, times[-1], times)[::-1])[::-1] - times
    return np.minimum(since, until)
