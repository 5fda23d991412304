"""Sequential convex programming over one interval: knots follow the last law; passes go on until they gain little."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.timing.jerk.interval import Interval
from pentapod.timing.jerk.knots import place_knots
from pentapod.timing.jerk.subproblem import Answer, Subproblem


def fastest_law(interval: Interval) -> Answer | None:
    """Return the fastest law of an interval, with shorter ramps out of rests where none is found; None after that."""
    for _ in range(interval.options.ramps.retries + 1):
        answer = _with_ramps(interval)
        if answer is not None:
            return answer
        interval = interval.shorter_ramps()
    return None


def _with_ramps(interval: Interval) -> Answer | None:
    """Return the fastest law with the interval's own ramps, None where none is found."""
    options = interval.options
    problem = Subproblem.on(interval, place_knots(interval, interval.x, 1.0, options.knots.rough_share))
    rough = _converged(problem, problem.start(), np.minimum(problem.top, problem.ramps), options.rough_passes)
    if rough is None:
        problem = Subproblem.on(interval, place_knots(interval, interval.x, 1.0))
        y, x_k = problem.start(), np.minimum(problem.top, problem.ramps)
    else:
        coarse, x = problem, _law_at_stations(interval, problem, rough)
        used = float(coarse.rows.acceleration_shares(coarse.values(rough)).max())
        problem = Subproblem.on(interval, place_knots(interval, x, min(1.0, options.knots.spare * used)), rough=coarse)
        y, x_k = _transferred(coarse, rough, problem)
    better = _converged(problem, y, x_k, options.passes)
    if better is None:
        return None
    answer = problem, better
    for _ in range(options.halvings):
        violated = _violated(interval, *answer)
        if not violated.any():
            break
        answer = _halved(interval, *answer, violated)
    return answer


def solve_locally(problem: Subproblem, y: Floats, x_k: Floats, stations: Floats) -> tuple[Floats, Floats]:
    """Return coefficients solved again about sorted stations (n,), and between which stations (2, k) they changed.

    x_k (N,): tangent points to begin with. Where nothing is found the window grows, up to the whole interval.
    """
    n, options, changed = len(y), problem.options, [np.zeros((2, 0))]
    reach = options.solver.seam_overlap // 2
    while len(stations):
        windows, last, failed = problem.windows_about(stations, reach), np.inf, np.zeros(len(stations), dtype=bool)
        for number in range(options.passes):
            solved, before, y = list[tuple[int, int]](), y, y.copy()
            for (low, high), better in zip(windows, problem.solved(before, x_k, 1, windows, (3, 3)), strict=True):
                if better is not None:
                    y[low:high] = better
                    solved.append((low, high))
                elif number == 0:
                    failed |= (stations >= problem.knots[low + 3]) & (stations <= problem.knots[high])
            windows, x_k = solved, problem.tangent_points(y)
            parts = [problem.gridpoints(low, high) for low, high in windows]
            seconds = sum(float((problem.weight[part] / np.sqrt(x_k[part])).sum()) for part in parts)
            if number == 0:
                changed.append(np.array([problem.knots[[low, high + 3]] for low, high in solved]).reshape(-1, 2).T)
            if last - seconds < options.min_gain * seconds or not windows:
                break
            last = seconds
        if reach >= n:
            break
        stations, reach = stations[failed], reach * options.local_growth
    return y, np.concatenate(changed, axis=1)


def _converged(problem: Subproblem, y: Floats, x_k: Floats, passes: int) -> Floats | None:
    """Return coefficients improved by passes until these gain little; None where the first finds nothing."""
    gains, last, min_gain = None, np.zeros(0), problem.options.min_gain
    for number in range(passes):
        better = problem.improved(y, x_k, number, gains)
        if better is None:
            return None if number == 0 else y
        y, x_k = better, problem.tangent_points(better)
        seconds = problem.weight / np.sqrt(x_k)
        if number > 0:
            gains = last - (1.0 + min_gain) * seconds
            if (last - seconds).sum() <= min_gain * seconds.sum():
                break
        last = seconds
    return y


def _halved(interval: Interval, problem: Subproblem, y: Floats, violated: Bools) -> Answer:
    """Return the answer with knots halved where limits are violated (K − 1,) and beside, solved again about there."""
    near = violated | np.append(violated[1:], False) | np.append(False, violated[:-1])
    middles = ((problem.inner[1:] + problem.inner[:-1]) / 2.0)[near]
    finer = Subproblem.on(interval, np.sort(np.concatenate([problem.inner, middles])), problem)
    return finer, solve_locally(finer, *_transferred(problem, y, finer), middles)[0]


def _violated(interval: Interval, problem: Subproblem, y: Floats) -> Bools:
    """Return between which inner knots (K − 1,) the spline violates a limit, or nearly stops, between gridpoints."""
    s = (problem.s[1:] + problem.s[:-1]) / 2.0
    rows, v = interval.rows_at(s), problem.at(y, s)
    x, ends, options = v[:, 0], problem.values(y)[:, 0], interval.options
    violated = (
        (rows.jerk_shares(v) > options.over_jerk)
        | (rows.acceleration_shares(v) > options.over_acceleration)
        | (x > options.over_speed * rows.ceiling)
        | (x < options.under_speed * np.minimum(ends[:-1], ends[1:]))
    )
    return np.asarray(violated.reshape(-1, options.solver.gridpoints_per_knot).any(axis=1))


def _law_at_stations(interval: Interval, problem: Subproblem, y: Floats) -> Floats:
    """Return x (N,) of a law at the interval's stations; the upper bound itself where it is nearly reached."""
    s, x = problem.s, problem.tangent_points(y)
    if problem.begin.join > 0.0:
        s, x = np.append(0.0, s), np.append(interval.x[0], x)
    if problem.end.join > 0.0:
        s, x = np.append(s, interval.length), np.append(x, interval.x[-1])
    x = np.interp(interval.s, s, x)
    return np.where(x > interval.options.bound_share * interval.x, interval.x, x)


def _transferred(old: Subproblem, y: Floats, new: Subproblem) -> tuple[Floats, Floats]:
    """Return coefficients (n,) and tangent points (N,) for a problem to start from, of another one's answer.

    A coefficient is the blossom, at the three knots inside its support, of the cubic between two of these knots: where
    the new problem has all knots of the old one this is the same spline.
    """
    t, n = new.knots, len(new.knots) - 4
    index = np.arange(n)
    pick = np.where(index < n // 2, index + 3, index)
    for shift in (2, 1):
        pick = np.where(t[index + shift + 1] > t[index + shift], index + shift, pick)
    width = t[pick + 1] - t[pick]
    low, high = t[pick] + 0.25 * width, t[pick] + 0.75 * width
    at, back = np.unique(np.concatenate([low, high]), return_inverse=True)
    v = old.at(y, at)[back]
    one, two = v[:n], v[n:]
    third = (two[:, 2] - one[:, 2]) / (high - low)
    a, b, c = (t[index + k] - low for k in (1, 2, 3))
    blossom = (
        one[:, 0] + one[:, 1] * (a + b + c) / 3.0 + one[:, 2] * (a * b + b * c + c * a) / 6.0 + third * a * b * c / 6.0
    )
    start, (fixed_start, fixed_end) = new.start(), new.fixed
    blossom = np.maximum(blossom, 1e-12 * new.top.max())
    blossom[:fixed_start] = start[:fixed_start]
    blossom[n - fixed_end :] = start[n - fixed_end :]
    x = old.at(y, np.clip(new.s, old.knots[0], old.knots[-1]))[:, 0]
    return blossom, np.maximum(np.minimum(x, new.top), new.options.solver.x_floor * new.top)
