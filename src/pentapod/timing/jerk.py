"""Jerk limits: the fastest law below the TOPP-RA profile whose leg jerks hold, with S-curve starts and stops.

x(s) = ṡ² becomes a cubic spline. A leg's jerk is √x (q‴ x + 1.5 q″ x′ + 0.5 q′ x″); with 1/√x replaced by its
tangent at the last iterate the limit is linear, and stricter than the true one. So each pass is convex, its answer
keeps the true limits, and the next pass starts from it and can only improve: the last iterate is the best.

At rest √x has no derivative. The law leaves rest with constant jerk, x = c s^(4/3), and joins the spline after a
small part of the ramp, with the ramp's speed and acceleration; so it comes to rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from pentapod.arrays import Floats, Ints
from pentapod.timing.jerk_kernels import convex_pass
from pentapod.timing.jerk_knots import law_knots
from pentapod.timing.jerk_rows import JerkRows, RowsAt
from pentapod.timing.spline_kernels import cubic_basis
from pentapod.timing.stages import Failure

PASSES = 3
GRIDPOINTS_PER_KNOT = 4

WINDOW = 256
"""Coefficients of a window: what it needs stays in a core's own cache."""

LEAD = 64
"""Coefficients on either side of a seam, beyond which the path has no say in what happens there."""

_COLD, _WARM = 0.1, 0.01
_JOIN = 0.01
"""Where the spline begins, as a share of the length over which the first ramp would reach another limit."""

_END_JERK = 0.98
_ITERATIONS = 60
_MOST_AGAIN = 0.6
"""Share of the coefficients up to which solving only what was lowered is worth it."""

_GAP = 1e-5
_KEPT = 1e-6


def jerk_limited(s: Floats, x: Floats, rows_at: RowsAt, marks: Floats, passes: int = PASSES) -> SmoothProfile | Failure:
    """Return the fastest jerk-limited profile below x (N + 1,) at s (N + 1,), which rests at both ends.

    marks: where the path's third derivative has kinks. A Failure where the passes find nothing.
    """
    problem = Problem.of(s, x, rows_at, marks)
    y = problem.start()
    around = np.minimum(problem.top, problem.ramps)
    for number in range(passes):
        better = problem.improved(y, around, number)
        if better is None:
            if number == 0:
                return Failure(-1, "no law below the fastest one keeps the jerk limits")
            break
        y = better
        around = np.maximum(problem.values(y)[:, 0], 1e-9 * problem.top)
    return SmoothProfile.of(problem, y)


def limited_again(
    before: SmoothProfile, s: Floats, x: Floats, rows_at: RowsAt, passes: int = PASSES
) -> SmoothProfile | None:
    """Return the profile for limits that were lowered at places, from the one before: solved anew about these alone.

    x (N + 1,) at s (N + 1,): the law without jerk limits, lowered too. None where the rests are touched, where most of
    the path is, or where a pass finds nothing: then it has to be solved as a whole.
    """
    problem = before.problem.lowered(s, x, rows_at)
    stretches = problem.stretches(before.problem)
    if stretches is None:
        return None
    y = before.y
    around = np.minimum(problem.values(y)[:, 0], problem.top)
    for number in range(passes):
        for low, high in stretches:
            held = (2 if low == 0 else 3, 2 if high == len(y) else 3)
            found = problem.solved(y, around, number, low, high, held)
            if found is None and number == 0:
                return None
            y = y if found is None else found
        around = np.maximum(problem.values(y)[:, 0], 1e-9 * problem.top)
    return SmoothProfile.of(problem, y)


@dataclass(frozen=True, eq=False)
class _Ramp:
    """The law next to a rest: x = c d^(4/3) at the distance d, the spline from the distance `join` on."""

    c: float
    join: float

    @classmethod
    def of(cls, rows: JerkRows, s: Floats, reach: float) -> _Ramp:
        """Return the ramp at the rest s[0] of rows at s, at most `reach` long."""
        jerk = _END_JERK / float(np.abs(2.0 * rows.jerks[0, :, 2]).max())
        push = 1.0 / max(float(np.abs(rows.first[0]).max()), 1e-300)
        c = 6.0 ** (4.0 / 3.0) / 4.0 * jerk ** (2.0 / 3.0)
        # Where the acceleration or the speed that the ramp reaches would be a limit's.
        length = min(push**3 / (6.0 * jerk**2), reach)
        within = max(int(np.searchsorted(np.abs(s - s[0]), length)), 1)
        length = min(length, (0.5 * float(rows.ceiling[:within].min()) / c) ** 0.75)
        return cls(c, _JOIN * length)

    def __call__(self, distance: Floats) -> Floats:
        return self.c * np.maximum(distance, self.join) ** (4.0 / 3.0)

    @property
    def slope(self) -> float:
        """x′ where the spline begins."""
        return 4.0 / 3.0 * self.c * self.join ** (1.0 / 3.0)


@dataclass(frozen=True, eq=False)
class Problem:
    """Knots, gridpoints and rows of one stretch between two rests."""

    s: Floats
    knots: Floats
    basis: Floats
    first: Ints
    rows: JerkRows
    top: Floats
    ramps: Floats
    weight: Floats
    start_ramp: _Ramp
    end_ramp: _Ramp
    length: float

    @classmethod
    def of(cls, s: Floats, x: Floats, rows_at: RowsAt, marks: Floats) -> Problem:
        """Return the problem below x (N + 1,) at s (N + 1,); arguments as for `jerk_limited`."""
        length = float(s[-1])
        coarse = rows_at(s)
        start = _Ramp.of(coarse, s, length / 8.0)
        end = _Ramp.of(
            JerkRows(
                coarse.first[::-1],
                coarse.second[::-1],
                coarse.offset[::-1],
                coarse.jerks[::-1],
                coarse.ceiling[::-1],
            ),
            s[::-1],
            length / 8.0,
        )
        inner = law_knots(s, x, coarse, marks, start.join, length - end.join)
        steps = np.diff(inner)[:, None] * (np.arange(GRIDPOINTS_PER_KNOT) / GRIDPOINTS_PER_KNOT)
        grid = np.append((inner[:-1, None] + steps).ravel(), inner[-1])
        knots = np.concatenate([[inner[0]] * 3, inner, [inner[-1]] * 3])
        basis, first = np.empty((len(grid), 3, 4)), np.empty(len(grid), dtype=np.int64)
        cubic_basis(knots, grid, basis, first)
        rows = rows_at(grid)
        top = np.minimum(np.interp(grid, s, x), rows.ceiling)
        weight = np.gradient(grid)
        ramps = np.minimum(start(grid), end(length - grid))
        weight *= len(grid) / (weight / np.sqrt(np.minimum(top, ramps))).sum()
        return cls(grid, knots, basis, first, rows, top, ramps, weight, start, end, length)

    def lowered(self, s: Floats, x: Floats, rows_at: RowsAt) -> Problem:
        """Return the problem with the same knots below other limits: x (N + 1,) at s (N + 1,), rows anew."""
        rows = rows_at(self.s)
        return replace(self, rows=rows, top=np.minimum(np.interp(self.s, s, x), rows.ceiling))

    def stretches(self, other: Problem) -> list[tuple[int, int]] | None:
        """Return the coefficients, from and to before, about the gridpoints at which limits are not the other's.

        None where these are at a rest, or most of the path.
        """
        changed = (
            (self.rows.jerks != other.rows.jerks).any(axis=(1, 2))
            | (self.rows.first != other.rows.first).any(axis=1)
            | (np.abs(self.top - other.top) > 1e-9 * other.top)
        )
        n = len(self.knots) - 4
        at = np.flatnonzero(changed)
        if changed[: 4 * GRIDPOINTS_PER_KNOT].any() or changed[-4 * GRIDPOINTS_PER_KNOT :].any():
            return None
        if not len(at):
            return []
        lows = np.maximum(self.first[at] - LEAD, 0)
        highs = np.minimum(self.first[at] + 4 + LEAD, n)
        apart = np.flatnonzero(lows[1:] > highs[:-1]) + 1
        found = [(int(lows[run[0]]), int(highs[run[-1]])) for run in np.split(np.arange(len(at)), apart)]
        return found if sum(high - low for low, high in found) < _MOST_AGAIN * n else None

    def start(self) -> Floats:
        """Return coefficients to start from; the two at each end are the ramps' and stay."""
        places = (self.knots[1:-3] + self.knots[2:-2] + self.knots[3:-1]) / 3.0
        y = 0.5 * np.interp(places, self.s, np.minimum(self.top, self.ramps))
        for k, ramp, h in (
            (0, self.start_ramp, self.knots[4] - self.knots[3]),
            (-1, self.end_ramp, self.knots[-4] - self.knots[-5]),
        ):
            y[k] = ramp.c * ramp.join ** (4.0 / 3.0)
            y[1 if k == 0 else -2] = y[k] + ramp.slope * h / 3.0
        return y

    def improved(self, y: Floats, around: Floats, number: int) -> Floats | None:
        """Return the coefficients after pass `number` with tangents at `around` (N,), None where it found nothing.

        Long stretches go in windows between coefficients that stay. The first pass has found these in windows of
        their own, about each seam with a lead on both sides; the seams of later passes lie halfway between the last
        ones, and what stays there is the last pass's, so that every window has an answer.
        """
        n = len(y)
        if n < 2 * WINDOW:
            return self.solved(y, around, number, 0, n, (2, 2))
        y = y.copy()
        seams = list(range(WINDOW if number % 2 == 0 else WINDOW // 2, n - WINDOW // 2, WINDOW))
        if number == 0:
            for seam in seams:
                low, high = max(seam - LEAD, 0), min(seam + LEAD, n)
                found = self.solved(y, around, 0, low, high, (2 if low == 0 else 0, 2 if high == n else 0))
                if found is None:
                    return self.solved(y, around, 0, 0, n, (2, 2))
                y[seam - 1 : seam + 2] = found[seam - 1 : seam + 2]
        better = y.copy()
        for left, right in pairwise([0, *seams, n]):
            low, high = max(left - 1, 0), min(right + 2, n)
            held = (2 if left == 0 else 3, 2 if right == n else 3)
            found = self.solved(y, around, number, low, high, held)
            if found is None and number == 0:
                return self.solved(y, around, 0, 0, n, (2, 2))
            if found is not None:
                better[low:high] = found[low:high]
        return better

    def solved(
        self, y: Floats, around: Floats, number: int, low: int, high: int, held: tuple[int, int]
    ) -> Floats | None:
        """Return y with the coefficients from low to before high improved; those `held` at either end stay."""
        here = slice(int(np.searchsorted(self.first, low)), int(np.searchsorted(self.first, high - 4, "right")))
        fixed = np.zeros(high - low, dtype=np.int64)
        fixed[: held[0]] = 1
        fixed[len(fixed) - held[1] :] = 1
        rows, part = self.rows, y[low:high].copy()
        moves = int(len(rows.offset) > 1)
        done, gap, breach = convex_pass(
            self.basis[here],
            self.first[here] - low,
            rows.second[here],
            0.5 * rows.first[here],
            rows.offset[here] if moves else rows.offset,
            moves,
            rows.jerks[here],
            around[here],
            self.top[here],
            self.weight[here],
            fixed,
            _COLD if number == 0 else _WARM,
            _ITERATIONS,
            _GAP,
            part,
        )
        if not (breach < _KEPT and np.isfinite(gap) and (done >= 0 or gap < 100.0 * _GAP)):
            return None
        y = y.copy() if high - low < len(y) else part
        y[low:high] = part
        return y

    def values(self, y: Floats) -> Floats:
        """Return x, x′, x″ (N, 3) at the gridpoints."""
        return np.einsum("ndk,nk->nd", self.basis, y[self.first[:, None] + np.arange(4)])


@dataclass(frozen=True, eq=False)
class SmoothProfile:
    """x = ṡ² (N,) and its slope x′ = 2 s̈ (N,) at stations (N,), both ends at rest; jerk about constant between.

    problem, y: what it is the answer to, and as which coefficients.
    """

    s: Floats
    x: Floats
    slope: Floats
    problem: Problem
    y: Floats

    @classmethod
    def of(cls, problem: Problem, y: Floats) -> SmoothProfile:
        """Return the profile of coefficients y, with both rests."""
        v = problem.values(y)
        return cls(
            np.concatenate([[0.0], problem.s, [problem.length]]),
            np.concatenate([[0.0], v[:, 0], [0.0]]),
            np.concatenate([[0.0], v[:, 1], [0.0]]),
            problem,
            y,
        )
