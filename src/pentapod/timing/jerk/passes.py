"""Sequential convex programming over one part: knots follow the last law; passes go on until they gain nothing."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.timing.jerk.about import about, tangents
from pentapod.timing.jerk.knots import law_knots
from pentapod.timing.jerk.part import Part
from pentapod.timing.jerk.problem import GRIDPOINTS_PER_KNOT, Answer, Problem

_SPARE = 1.1
_LEAST = 1e-9
_REACHED = 0.995


def answer_of(part: Part) -> Answer | None:
    """Return the fastest law of a part, None where none is found; ramps out of rests are shorter where they must be."""
    for _ in range(part.options.ramps + 1):
        answer = _answer_of(part)
        if answer is not None:
            return answer
        part = part.shorter()
    return None


def _answer_of(part: Part) -> Answer | None:
    options, found = part.options, _first(part)
    if found is None:
        inner = law_knots(part, part.x, 1.0)
        problem = Problem.on(part, inner)
        y, around = problem.start(), np.minimum(problem.top, problem.ramps)
    else:
        coarse, rough = found
        problem = Problem.on(part, law_knots(part, _law_at(part, coarse, rough), _pushed(coarse, rough)))
        y, around = _carried(coarse, rough, problem)
    better = _settled(problem, y, around, options.passes)
    if better is None:
        return None
    answer = problem, better
    for _ in range(options.halvings):
        bad = _exceeding(part, *answer)
        if not bad.any():
            break
        answer = _halved(part, *answer, bad)
    return answer


def _first(part: Part) -> Answer | None:
    """Return a rough answer with few knots, even in the time of the law without jerk limits."""
    problem = Problem.on(part, law_knots(part, part.x, 1.0, part.options.rough_knots))
    better = _settled(problem, problem.start(), np.minimum(problem.top, problem.ramps), part.options.rough_passes)
    return None if better is None else (problem, better)


def _settled(problem: Problem, y: Floats, around: Floats, passes: int) -> Floats | None:
    """Return coefficients improved by passes until these gain next to nothing; None where the first finds nothing."""
    gains, last = None, np.zeros(0)
    for number in range(passes):
        better = problem.improved(y, around, number, gains)
        if better is None:
            return None if number == 0 else y
        y, around = better, tangents(problem, better)
        taken = problem.weight / np.sqrt(around)
        if number > 0:
            gains = last - (1.0 + problem.options.settled) * taken
            if (last - taken).sum() <= problem.options.settled * taken.sum():
                break
        last = taken
    return y


def _halved(part: Part, problem: Problem, y: Floats, bad: Bools) -> Answer:
    """Return the answer with knots twice as close where it is bad (K − 1,) and beside; solved anew about there."""
    near = bad | np.append(bad[1:], False) | np.append(False, bad[:-1])
    middles = ((problem.inner[1:] + problem.inner[:-1]) / 2.0)[near]
    finer = Problem.on(part, np.sort(np.concatenate([problem.inner, middles])), problem)
    return finer, about(finer, *_carried(problem, y, finer), middles)[0]


def _exceeding(part: Part, problem: Problem, y: Floats) -> Bools:
    """Return between which inner knots (K − 1,) the spline exceeds a limit, or all but stops, between gridpoints."""
    s = (problem.s[1:] + problem.s[:-1]) / 2.0
    rows, v = part.rows_at(s), problem.at(y, s)
    x, ends, options = v[:, 0], problem.values(y)[:, 0], part.options
    bad = (
        (rows.jerk_uses(v) > options.over_jerk)
        | (rows.pushes(v) > options.over_push)
        | (x > options.over_speed * rows.ceiling)
    )
    bad |= x < options.under_speed * np.minimum(ends[:-1], ends[1:])
    return np.asarray(bad.reshape(-1, GRIDPOINTS_PER_KNOT).any(axis=1))


def _pushed(problem: Problem, y: Floats) -> float:
    """Return the share of an acceleration limit that a law uses, a little more than at its gridpoints, at most 1."""
    return min(1.0, _SPARE * float(problem.rows.pushes(problem.values(y)).max()))


def _law_at(part: Part, problem: Problem, y: Floats) -> Floats:
    """Return x (N + 1,) of a law at the part's stations; the bound itself where it is all but reached."""
    s, x = problem.s, np.maximum(problem.values(y)[:, 0], _LEAST * problem.top)
    if problem.begin.join > 0.0:
        s, x = np.append(0.0, s), np.append(part.x[0], x)
    if problem.end.join > 0.0:
        s, x = np.append(s, part.length), np.append(x, part.x[-1])
    x = np.interp(part.s, s, x)
    return np.where(x > _REACHED * part.x, part.x, x)


def _carried(old: Problem, y: Floats, new: Problem) -> tuple[Floats, Floats]:
    """Return coefficients (n,) and tangents (N,) to start another problem from, of a problem's answer.

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
    start, (begun, ended) = new.start(), new.held
    blossom = np.maximum(blossom, 1e-12 * new.top.max())
    blossom[:begun] = start[:begun]
    blossom[n - ended :] = start[n - ended :]
    x = old.at(y, np.clip(new.s, old.knots[0], old.knots[-1]))[:, 0]
    return blossom, np.maximum(np.minimum(x, new.top), _LEAST * new.top)
