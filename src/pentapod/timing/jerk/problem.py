"""One convex subproblem of the jerk passes: a cubic B-spline with linear rows at its gridpoints, solved in windows."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.timing.jerk.jerk_kernels import convex_pass
from pentapod.timing.jerk.options import JerkOptions
from pentapod.timing.jerk.part import End, Part
from pentapod.timing.jerk.rows import ROW_NAMES, JerkRows, Run
from pentapod.timing.jerk.spline_kernels import cubic_basis, spline_values

GRIDPOINTS_PER_KNOT = 4

WINDOW = 256
"""Coefficients of a window: what it needs stays in a core's own cache."""

LEAD = 64
"""Coefficients on either side of a seam, beyond which the path has no say in what happens there."""

_COLD, _WARM = (1.0, 0.1), (0.01, 0.1, 1.0)
"""Levels of slacks and multipliers to start from, one after the other until one leads to an answer: those of rows of
order 1, and of an answer that is nearly right."""
_ITERATIONS = 60

_GAP = 1e-5
_KEPT = 1e-6


@dataclass(frozen=True, eq=False)
class Problem:
    """Knots, gridpoints and rows of one stretch, and how the spline begins and ends."""

    s: Floats
    knots: Floats
    basis: Floats
    first: Ints
    rows: JerkRows
    top: Floats
    ramps: Floats
    weight: Floats
    begin: End
    end: End
    length: float
    options: JerkOptions

    @classmethod
    def on(cls, part: Part, inner: Floats, before: Problem | None = None) -> Problem:
        """Return the problem with inner knots (K,); rows of gridpoints that `before` has are taken from there."""
        steps = np.diff(inner)[:, None] * (np.arange(GRIDPOINTS_PER_KNOT) / GRIDPOINTS_PER_KNOT)
        grid = np.append((inner[:-1, None] + steps).ravel(), inner[-1])
        knots = np.concatenate([[inner[0]] * 3, inner, [inner[-1]] * 3])
        basis, first = np.empty((len(grid), 3, 4)), np.empty(len(grid), dtype=np.int64)
        cubic_basis(knots, grid, basis, first)
        rows = part.rows_at(grid) if before is None else _some_anew(part, grid, before)
        top = np.minimum(np.interp(grid, part.s, part.x), rows.ceiling)
        weight = np.gradient(grid)
        ramps = np.minimum(part.begin.bound(grid), part.end.bound(part.length - grid))
        weight *= len(grid) / (weight / np.sqrt(np.minimum(top, ramps))).sum()
        return cls(grid, knots, basis, first, rows, top, ramps, weight, part.begin, part.end, part.length, part.options)

    @property
    def inner(self) -> Floats:
        """Knots (K,), each once."""
        return self.knots[3:-3]

    def stretches(self, stations: Floats, lead: int) -> list[tuple[int, int]]:
        """Return stretches of coefficients, from and to before, about sorted stations (n,) between inner knots.

        With `lead` coefficients on either side.
        """
        n = len(self.knots) - 4
        at = np.clip(np.searchsorted(self.knots, stations, "right") - 1, 3, n - 1)
        lows, highs = np.maximum(at - 3 - lead, 0), np.minimum(at + 1 + lead, n)
        apart = np.flatnonzero(lows[1:] > highs[:-1]) + 1
        return [(int(lows[run[0]]), int(highs[run[-1]])) for run in np.split(np.arange(len(at)), apart)]

    @property
    def held(self) -> tuple[int, int]:
        """How many coefficients at either end are given."""
        return len(self.begin.coefficients(1.0)), len(self.end.coefficients(1.0))

    def start(self) -> Floats:
        """Return coefficients to start from; those that are given at the ends stay."""
        places = (self.knots[1:-3] + self.knots[2:-2] + self.knots[3:-1]) / 3.0
        y = 0.5 * np.interp(places, self.s, np.minimum(self.top, self.ramps))
        for k, value in enumerate(self.begin.coefficients(float(self.inner[1] - self.inner[0]))):
            y[k] = value
        for k, value in enumerate(self.end.coefficients(float(self.inner[-1] - self.inner[-2]))):
            y[-1 - k] = value
        return y

    def improved(self, y: Floats, around: Floats, number: int, gains: Floats | None = None) -> Floats | None:
        """Return the coefficients after pass `number` with tangents at `around` (N,), None where it found nothing.

        Long stretches go in windows between coefficients that stay. The first pass has found these in windows of
        their own, about each seam with a lead on both sides; the seams of later passes lie halfway between the last
        ones, and what stays there is the last pass's, so that every window has an answer. gains (N,): what the pass
        before has won at each gridpoint, less what is worth another one; a window without any is left as it is.
        """
        n = len(y)
        if n < 2 * WINDOW:
            return self.solved(y, around, number, 0, n, self.held)
        y = y.copy()
        seams = list(range(WINDOW if number % 2 == 0 else WINDOW // 2, n - WINDOW // 2, WINDOW))
        if number == 0:
            for seam in seams:
                low, high = max(seam - LEAD, 0), min(seam + LEAD, n)
                found = self.solved(
                    y, around, 0, low, high, (self.held[0] if low == 0 else 0, self.held[1] if high == n else 0)
                )
                if found is None:
                    return self.solved(y, around, 0, 0, n, self.held)
                y[seam - 1 : seam + 2] = found[seam - 1 : seam + 2]
        better = y.copy()
        for left, right in pairwise([0, *seams, n]):
            low, high = max(left - 1, 0), min(right + 2, n)
            if gains is not None and gains[self.gridpoints(low, high)].sum() <= 0.0:
                continue
            held = (self.held[0] if left == 0 else 3, self.held[1] if right == n else 3)
            found = self.solved(y, around, number, low, high, held)
            if found is None and number == 0:
                return self.solved(y, around, 0, 0, n, self.held)
            if found is not None:
                better[low:high] = found[low:high]
        return better

    def gridpoints(self, low: int, high: int) -> slice:
        """Return the gridpoints that coefficients from low to before high alone have a say in."""
        return slice(int(np.searchsorted(self.first, low)), int(np.searchsorted(self.first, high - 4, "right")))

    def solved(
        self, y: Floats, around: Floats, number: int, low: int, high: int, held: tuple[int, int]
    ) -> Floats | None:
        """Return y with the coefficients from low to before high improved; those `held` at either end stay."""
        levels = _COLD if number == 0 else _WARM
        answers = (self._solved(y, around, level, low, high, held) for level in levels)
        return next((answer for answer in answers if answer is not None), None)

    def _solved(
        self, y: Floats, around: Floats, level: float, low: int, high: int, held: tuple[int, int]
    ) -> Floats | None:
        here = self.gridpoints(low, high)
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
            -rows.offset[here] if moves else -rows.offset,
            moves,
            rows.jerks[here],
            around[here],
            self.top[here],
            self.weight[here],
            fixed,
            level,
            _ITERATIONS,
            _GAP,
            part,
        )
        if not (breach < _KEPT and np.isfinite(gap) and (done >= 0 or gap < 100.0 * _GAP)):
            return None
        y = y.copy() if high - low < len(y) else part
        y[low:high] = part
        return y

    def run(self, y: Floats) -> Run:
        """Return the law at the gridpoints, and halfway between: what is made of them follows the spline closely.

        Rests included.
        """
        v, s = np.empty((2 * len(self.s) - 1, 3)), np.empty(2 * len(self.s) - 1)
        s[::2], s[1::2] = self.s, (self.s[1:] + self.s[:-1]) / 2.0
        v[::2], v[1::2] = self.values(y), self.at(y, s[1::2])
        x, slope = v[:, 0], v[:, 1]
        if self.begin.join > 0.0:
            s, x, slope = np.append(0.0, s), np.append(0.0, x), np.append(0.0, slope)
        if self.end.join > 0.0:
            s, x, slope = np.append(s, self.length), np.append(x, 0.0), np.append(slope, 0.0)
        return s, x, slope

    def seconds(self, y: Floats) -> float:
        """Return about how long the law lasts."""
        s, x, _ = self.run(y)
        v = np.sqrt(x)
        return float((2.0 * np.diff(s) / (v[:-1] + v[1:])).sum())

    def values(self, y: Floats) -> Floats:
        """Return x, x′, x″ (N, 3) at the gridpoints."""
        return np.einsum("ndk,nk->nd", self.basis, y[self.first[:, None] + np.arange(4)])

    def at(self, y: Floats, s: Floats) -> Floats:
        """Return x, x′, x″ (n, 3) of coefficients y at sorted stations s (n,) of the spline."""
        basis, first, v = np.empty((len(s), 3, 4)), np.empty(len(s), dtype=np.int64), np.empty((len(s), 3))
        cubic_basis(self.knots, s, basis, first)
        spline_values(basis, first, y, v)
        return v


Answer = tuple[Problem, Floats]
"""A problem and the coefficients that answer it."""


def _some_anew(part: Part, grid: Floats, before: Problem) -> JerkRows:
    """Return the rows at gridpoints (N,), of which those that another problem has are taken from there."""
    near = np.minimum(np.searchsorted(before.s, grid), len(before.s) - 1)
    anew = before.s[near] != grid
    fresh = part.rows_at(grid[anew])
    columns: list[Floats] = []
    for name in ROW_NAMES:
        old, new = getattr(before.rows, name), getattr(fresh, name)
        if len(old) == len(before.s):
            column = old[near]
            column[anew] = new
        else:  # one row for all
            column = old
        columns.append(column)
    return JerkRows(*columns)
