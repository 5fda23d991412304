"""One convex problem after the other: the jerk passes over one stretch of the path."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from pentapod.arrays import Floats, Ints
from pentapod.timing.jerk_ends import End, Open, Ramp, Steady
from pentapod.timing.jerk_kernels import convex_pass
from pentapod.timing.jerk_knots import law_knots
from pentapod.timing.jerk_rows import ROW_NAMES, JerkRows, RowsAt
from pentapod.timing.spline_kernels import cubic_basis, spline_values

GRIDPOINTS_PER_KNOT = 4

WINDOW = 256
"""Coefficients of a window: what it needs stays in a core's own cache."""

LEAD = 64
"""Coefficients on either side of a seam, beyond which the path has no say in what happens there."""

_COLD, _WARM = (1.0, 0.1), (0.01,)
"""Levels of slacks and multipliers to start from, one after the other until one leads to an answer: those of rows of
order 1, and of an answer that is nearly right."""
_ITERATIONS = 60
_MOST_AGAIN = 0.6
"""Share of the coefficients up to which solving only what was lowered is worth it."""

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

    @classmethod
    def of(
        cls, s: Floats, x: Floats, rows_at: RowsAt, marks: Floats, goes_on: tuple[bool, bool] = (False, False)
    ) -> Problem:
        """Return the problem below x (N + 1,) at s (N + 1,), from s = 0; arguments as for `jerk_limited`.

        goes_on: whether the path goes on beyond either end.
        """
        length = float(s[-1])
        coarse = rows_at(s)
        turned = JerkRows(*(getattr(coarse, name)[::-1] for name in ROW_NAMES))
        begin, end = (
            Open() if on else Ramp.of(rows, there, length / 8.0) if here == 0.0 else Steady(float(here))
            for on, rows, there, here in ((goes_on[0], coarse, s, x[0]), (goes_on[1], turned, s[::-1], x[-1]))
        )
        inner = law_knots(s, x, coarse, marks, begin.join, length - end.join)
        steps = np.diff(inner)[:, None] * (np.arange(GRIDPOINTS_PER_KNOT) / GRIDPOINTS_PER_KNOT)
        grid = np.append((inner[:-1, None] + steps).ravel(), inner[-1])
        knots = np.concatenate([[inner[0]] * 3, inner, [inner[-1]] * 3])
        basis, first = np.empty((len(grid), 3, 4)), np.empty(len(grid), dtype=np.int64)
        cubic_basis(knots, grid, basis, first)
        rows = rows_at(grid)
        top = np.minimum(np.interp(grid, s, x), rows.ceiling)
        weight = np.gradient(grid)
        ramps = np.minimum(begin.bound(grid), end.bound(length - grid))
        weight *= len(grid) / (weight / np.sqrt(np.minimum(top, ramps))).sum()
        return cls(grid, knots, basis, first, rows, top, ramps, weight, begin, end, length)

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

    @property
    def held(self) -> tuple[int, int]:
        """How many coefficients at either end are given."""
        return len(self.begin.coefficients(1.0)), len(self.end.coefficients(1.0))

    def start(self) -> Floats:
        """Return coefficients to start from; those that are given at the ends stay."""
        places = (self.knots[1:-3] + self.knots[2:-2] + self.knots[3:-1]) / 3.0
        y = 0.5 * np.interp(places, self.s, np.minimum(self.top, self.ramps))
        for k, value in enumerate(self.begin.coefficients(float(self.knots[4] - self.knots[3]))):
            y[k] = value
        for k, value in enumerate(self.end.coefficients(float(self.knots[-4] - self.knots[-5]))):
            y[-1 - k] = value
        return y

    def improved(self, y: Floats, around: Floats, number: int) -> Floats | None:
        """Return the coefficients after pass `number` with tangents at `around` (N,), None where it found nothing.

        Long stretches go in windows between coefficients that stay. The first pass has found these in windows of
        their own, about each seam with a lead on both sides; the seams of later passes lie halfway between the last
        ones, and what stays there is the last pass's, so that every window has an answer.
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
            held = (self.held[0] if left == 0 else 3, self.held[1] if right == n else 3)
            found = self.solved(y, around, number, low, high, held)
            if found is None and number == 0:
                return self.solved(y, around, 0, 0, n, self.held)
            if found is not None:
                better[low:high] = found[low:high]
        return better

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

    def values(self, y: Floats) -> Floats:
        """Return x, x′, x″ (N, 3) at the gridpoints."""
        return np.einsum("ndk,nk->nd", self.basis, y[self.first[:, None] + np.arange(4)])

    def at(self, y: Floats, s: Floats) -> Floats:
        """Return x, x′, x″ (n, 3) of coefficients y at sorted stations s (n,) of the spline."""
        basis, first, v = np.empty((len(s), 3, 4)), np.empty(len(s), dtype=np.int64), np.empty((len(s), 3))
        cubic_basis(self.knots, s, basis, first)
        spline_values(basis, first, y, v)
        return v
