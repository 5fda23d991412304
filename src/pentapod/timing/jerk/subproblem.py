"""Convex subproblem of the jerk limits: a cubic B-spline x(s) with linear rows at gridpoints, solved in windows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.ndimage import maximum_filter1d

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.numerics.threads import on_all_cores
from pentapod.timing.jerk.interval import End, Interval
from pentapod.timing.jerk.jerk_kernels import minimise_duration
from pentapod.timing.jerk.options import JerkOptions
from pentapod.timing.jerk.row_kernels import binding_rows
from pentapod.timing.jerk.rows import ROW_NAMES, JerkRows
from pentapod.timing.jerk.spline_kernels import cubic_basis, spline_values
from pentapod.timing.time_law.motion_law import SpeedNodes


@dataclass(frozen=True, eq=False)
class Subproblem:
    """Spline, rows and end conditions of one interval.

    s (N,): gridpoints; knots (K + 6,); basis (N, 3, 4), first (N,): B-splines at gridpoints; top (N,): upper bound of
    x; ramps (N,): bound by the ramps at the ends; weight (N,): of 1/√x in the objective. multipliers (N, P, 2): of all
    rows, from the last solve, 0 where there was none; each solve replaces its own, and starts from them.
    """

    s: Floats
    knots: Floats
    basis: Floats
    first: Ints
    rows: JerkRows
    top: Floats
    ramps: Floats
    weight: Floats
    multipliers: Floats
    begin: End
    end: End
    length: float
    least_step: float
    options: JerkOptions

    @classmethod
    def on(
        cls, interval: Interval, inner: Floats, before: Subproblem | None = None, rough: Subproblem | None = None
    ) -> Subproblem:
        """Return the problem with inner knots (K,); rows of gridpoints that `before` has are taken from there.

        rough: a problem from whose multipliers it starts, where there is none before.
        """
        each = interval.options.solver.gridpoints_per_knot
        steps = np.diff(inner)[:, None] * (np.arange(each) / each)
        grid = np.append((inner[:-1, None] + steps).ravel(), inner[-1])
        knots = np.concatenate([[inner[0]] * 3, inner, [inner[-1]] * 3])
        basis, first = np.empty((len(grid), 3, 4)), np.empty(len(grid), dtype=np.int64)
        cubic_basis(knots, grid, basis, first)
        rows = interval.rows_at(grid) if before is None else _updated_rows(interval, grid, before)
        top = np.minimum(np.interp(grid, interval.s, interval.x), rows.ceiling)
        ramps = np.minimum(interval.begin.bound(grid), interval.end.bound(interval.length - grid))
        weight = np.gradient(grid)
        weight *= len(grid) / (weight / np.sqrt(np.minimum(top, ramps))).sum()
        multipliers = _multipliers(grid, rows, before or rough)
        ends = interval.begin, interval.end, interval.length, interval.least_step
        return cls(grid, knots, basis, first, rows, top, ramps, weight, multipliers, *ends, interval.options)

    @cached_property
    def binding(self) -> tuple[Ints, Ints]:
        """The numbers of the rows that can bind (M,), and where those of each gridpoint begin (N + 1,)."""
        count = self.multipliers.shape[0] * self.multipliers.shape[1]
        index, start = np.empty(count, dtype=np.int64), np.empty(len(self.s) + 1, dtype=np.int64)
        rows, varies = self.rows, int(len(self.rows.offset) > 1)
        size = binding_rows(rows.second, 0.5 * rows.first, -rows.offset, varies, rows.jerks, self.top, index, start)
        return index[:size].copy(), start

    @property
    def inner(self) -> Floats:
        """Knots (K,), each once."""
        return self.knots[3:-3]

    @property
    def fixed(self) -> tuple[int, int]:
        """How many coefficients are given at either end."""
        return len(self.begin.coefficients(1.0)), len(self.end.coefficients(1.0))

    def windows_about(self, stations: Floats, reach: int) -> list[tuple[int, int]]:
        """Return windows of coefficients, from and to before, about sorted stations (n,), `reach` to either side."""
        n = len(self.knots) - 4
        at = np.clip(np.searchsorted(self.knots, stations, "right") - 1, 3, n - 1)
        lows, highs = np.maximum(at - 3 - reach, 0), np.minimum(at + 1 + reach, n)
        apart = np.flatnonzero(lows[1:] > highs[:-1]) + 1
        return [(int(lows[run[0]]), int(highs[run[-1]])) for run in np.split(np.arange(len(at)), apart)]

    def start(self) -> Floats:
        """Return coefficients to start from, with those that are given at the ends."""
        places = (self.knots[1:-3] + self.knots[2:-2] + self.knots[3:-1]) / 3.0
        y = 0.5 * np.interp(places, self.s, np.minimum(self.top, self.ramps))
        for k, value in enumerate(self.begin.coefficients(float(self.inner[1] - self.inner[0]))):
            y[k] = value
        for k, value in enumerate(self.end.coefficients(float(self.inner[-1] - self.inner[-2]))):
            y[-1 - k] = value
        return y

    def tangent_points(self, y: Floats) -> Floats:
        """Return x (N,) at the gridpoints, about which the next subproblem is linearised."""
        return np.maximum(self.values(y)[:, 0], self.options.solver.x_floor * self.top)

    def improved(self, y: Floats, x_k: Floats, number: int, gains: Floats | None = None) -> Floats | None:
        """Return the coefficients after pass `number`, linearised about x_k (N,); None where it finds nothing.

        Long intervals are solved in windows between coefficients that stay. The first pass finds these in windows
        of their own, which overlap each seam; the seams of each later pass lie halfway between the last ones, and keep
        the last pass's values, so that every window has a solution. gains (N,): decrease of the duration by the pass
        before at each gridpoint, less what is worth another one; a window that gained nothing is left as it is.
        """
        n, size = len(y), self.options.solver.window
        reach = min(self.options.solver.seam_overlap, size // 2)  # no two seams have a window in common
        if n < 2 * size:
            return self.solved(y, x_k, number, [(0, n)], (0, 0))[0]
        y = y.copy()
        seams = list(range(size if number % 2 == 0 else size // 2, n - size // 2, size))
        if number == 0:
            about = [(max(seam - reach, 0), min(seam + reach, n)) for seam in seams]
            for seam, (low, _), found in zip(seams, about, self.solved(y, x_k, 0, about, (0, 0)), strict=True):
                if found is None:
                    return self.solved(y, x_k, 0, [(0, n)], (0, 0))[0]
                y[seam - 1 : seam + 2] = found[seam - 1 - low : seam + 2 - low]
        windows = [(max(left - 1, 0), min(right + 2, n)) for left, right in pairwise([0, *seams, n])]
        if gains is not None:
            windows = [window for window in windows if gains[self.gridpoints(*window)].sum() > 0.0]
        better = y.copy()
        for (low, high), found in zip(windows, self.solved(y, x_k, number, windows, (3, 3)), strict=True):
            if found is None and number == 0:
                return self.solved(y, x_k, 0, [(0, n)], (0, 0))[0]
            if found is not None:
                better[low:high] = found
        return better

    def gridpoints(self, low: int, high: int) -> slice:
        """Return the gridpoints at which the spline depends on coefficients from low to before high alone."""
        return slice(int(np.searchsorted(self.first, low)), int(np.searchsorted(self.first, high - 4, "right")))

    def solved(
        self, y: Floats, x_k: Floats, number: int, windows: list[tuple[int, int]], inside: tuple[int, int]
    ) -> list[Floats | None]:
        """Return the optimised coefficients of windows, from low to before high, None where no start level converges.

        windows: with no gridpoints in common; they are solved on all cores. inside: how many coefficients stay at an
        end of a window that is no end of the interval.
        """
        options = self.options.solver
        levels = options.cold_levels if number == 0 else options.warm_levels
        starts = ((options.known_level, True), *((level, False) for level in levels))

        def optimised(window: tuple[int, int]) -> Floats | None:
            low, high = window
            fixed = self.fixed[0] if low == 0 else inside[0], self.fixed[1] if high == len(y) else inside[1]
            known = self.multipliers[self.gridpoints(low, high), -1, 0]
            answers = (self._solved(y, x_k, *start, low, high, fixed) for start in starts[0 if known.all() else 1 :])
            return next((answer for answer in answers if answer is not None), None)

        _ = self.binding  # made once, not by each thread
        return on_all_cores(optimised, windows)

    def _solved(
        self, y: Floats, x_k: Floats, level: float, known: bool, low: int, high: int, ends: tuple[int, int]
    ) -> Floats | None:
        """Return the coefficients from low to before high optimised, from slacks and multipliers on a level.

        known: whether multipliers of the last solve count where they are above it.
        """
        here, options = self.gridpoints(low, high), self.options.solver
        fixed = np.zeros(high - low, dtype=np.int64)
        fixed[: ends[0]] = 1
        fixed[len(fixed) - ends[1] :] = 1
        rows, part, (index, start) = self.rows, y[low:high].copy(), self.binding
        begin, end = int(start[here.start]), int(start[here.stop])
        multipliers = self.multipliers[here].copy() if known else np.zeros_like(self.multipliers[here])
        varies = int(len(rows.offset) > 1)
        converged, gap, residual = minimise_duration(
            self.basis[here],
            self.first[here] - low,
            rows.second[here],
            0.5 * rows.first[here],
            -rows.offset[here] if varies else -rows.offset,
            varies,
            rows.jerks[here],
            index[begin:end],
            start[here.start : here.stop + 1] - begin,
            x_k[here],
            self.top[here],
            self.weight[here],
            fixed,
            level,
            options.iterations,
            options.gap,
            part,
            multipliers,
        )
        if not (residual < options.accepted_residual and (converged or gap < options.accepted_gap)):
            return None
        self.multipliers[here] = multipliers
        return part

    def nodes(self, y: Floats) -> SpeedNodes:
        """Return the law at rests, at gridpoints and halfway between, so that cubics follow the spline closely.

        At most one node in each least step is kept, the fastest one in any case: setpoints do not tell them apart.
        Where the spline dips to 0 or below, which is possible between gridpoints and at seams of windows, the law goes
        on slowly.
        """
        v, s = np.empty((2 * len(self.s) - 1, 3)), np.empty(2 * len(self.s) - 1)
        s[::2], s[1::2] = self.s, (self.s[1:] + self.s[:-1]) / 2.0
        v[::2], v[1::2] = self.values(y), self.at(y, s[1::2])
        stands = 2 * np.flatnonzero(v[::2, 0] < self.options.solver.x_floor * self.top)
        v[stands, 0], v[stands, 1] = self.options.solver.x_floor * self.top[stands // 2], 0.0
        least = self.options.solver.dip * np.minimum(v[:-2:2, 0], v[2::2, 0])
        dips = 1 + 2 * np.flatnonzero(v[1::2, 0] < least)
        v[dips, 0], v[dips, 1] = least[dips // 2], 0.0
        x, slope = v[:, 0], v[:, 1]
        if self.begin.join > 0.0:
            s, x, slope = np.append(0.0, s), np.append(0.0, x), np.append(0.0, slope)
        if self.end.join > 0.0:
            s, x, slope = np.append(s, self.length), np.append(x, 0.0), np.append(slope, 0.0)
        if self.least_step > 0.0:
            speed = np.sqrt(x)
            times = np.cumsum(2.0 * np.diff(s) / (speed[:-1] + speed[1:]))
            kept = np.concatenate([[True], np.diff(np.floor(times / self.least_step), prepend=0.0) > 0.0])
            kept[[-1, int(x.argmax())]] = True
            s, x, slope = s[kept], x[kept], slope[kept]
        return SpeedNodes(s, x, slope)

    def seconds(self, y: Floats) -> float:
        """Return about how long the law lasts."""
        nodes = self.nodes(y)
        v = np.sqrt(nodes.x)
        return float((2.0 * np.diff(nodes.s) / (v[:-1] + v[1:])).sum())

    def values(self, y: Floats) -> Floats:
        """Return x, x′, x″ (N, 3) at the gridpoints."""
        return np.einsum("ndk,nk->nd", self.basis, y[self.first[:, None] + np.arange(4)])

    def at(self, y: Floats, s: Floats) -> Floats:
        """Return x, x′, x″ (n, 3) at sorted stations s (n,) of the spline."""
        basis, first, v = np.empty((len(s), 3, 4)), np.empty(len(s), dtype=np.int64), np.empty((len(s), 3))
        cubic_basis(self.knots, s, basis, first)
        spline_values(basis, first, y, v)
        return v


Answer = tuple[Subproblem, Floats]
"""A subproblem and the coefficients that solve it."""


def _multipliers(grid: Floats, rows: JerkRows, given: Subproblem | None) -> Floats:
    """Return multipliers of the rows at gridpoints (N,) to start from: those of another problem nearby, or zeros."""
    if given is None:
        return np.zeros((len(grid), rows.first.shape[1] + rows.jerks.shape[1] + 1, 2))
    return given.multipliers[np.searchsorted((given.s[1:] + given.s[:-1]) / 2.0, grid)]


def _updated_rows(interval: Interval, grid: Floats, before: Subproblem) -> JerkRows:
    """Return the rows at gridpoints (N,); those of gridpoints that another problem has are taken from there."""
    near = np.minimum(np.searchsorted(before.s, grid), len(before.s) - 1)
    new = before.s[near] != grid
    # Rows depend on the stations beside them.
    beside: Bools = np.asarray(maximum_filter1d(new, 4 * interval.options.solver.gridpoints_per_knot + 1), dtype=bool)
    fresh, within = interval.rows_at(grid[beside]), new[beside]
    columns: list[Floats] = []
    for name in ROW_NAMES:
        column = getattr(before.rows, name)
        if len(column) == len(before.s):  # else one row for all
            column = column[near]
            column[new] = getattr(fresh, name)[within]
        columns.append(column)
    return JerkRows(*columns)
