"""Restoration of the margin: a spline of the tool axis changes only near the waypoints that are short of it.

A few waypoints are short, as beside an edge, and the path is long. So the coefficients around these places are moved by
convex programs of their own, and all others stay as they are, bit for bit. All stretches are solved as one
banded program; each takes its part of the step, or does not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.progress import Progress, silent
from pentapod.numerics.convex.banded_qp import NEIGHBOURS, BandedQP, SoftRows
from pentapod.planning.tool_axis.axis_programs import AxisPrograms, Trial, shaped_by
from pentapod.planning.tool_axis.spline import BANDS, within_discs
from pentapod.planning.tool_axis.stretches import Stretches


@dataclass(frozen=True)
class RestorationOptions:
    """Options of the restoration.

    beside: coefficients on either side of those at short waypoints that may move at first; more: factor on it where
    that is not enough, up to `most`; then the waypoint is given up, and with it those of the same stretch that are
    short by at least the share `alike` of it. programs: at most. bearable: by how much a margin may stay short at the
    price of the cost of the whole spline, or of `least_cost` (rad²) if that is more. ask: share of what the trust
    region allows that a program asks at most. less: a step is taken if the sum of the shortfalls of its stretch falls
    to this share, and the largest does not grow.

    largest, least: radii of the trust region, as shares of the cone; shrink: factor on them after a step that was not
    taken.
    """

    beside: int = 8
    more: int = 2
    most: int = 32
    alike: float = 0.5
    programs: int = 100
    bearable: float = 1e-2
    least_cost: float = 1.0
    ask: float = 0.5
    less: float = 0.9
    largest: float = 0.5
    least: float = 1e-3
    shrink: float = 0.4


OPTIONS = RestorationOptions()

_ANY = -1e3
"""A margin that all axes keep."""

_GENTLY = replace(OPTIONS, largest=0.02)
"""How axes are brought within their limit: in short steps, so that they lose little of the margins."""


def restored(
    programs: AxisPrograms,
    c: Floats,
    rows: Ints,
    margins: Floats,
    keep: float,
    options: RestorationOptions = OPTIONS,
    progress: Progress = silent,
) -> tuple[Floats, Floats]:
    """Return coefficients (K, 2) near c that keep a margin at waypoints `rows` (n,), or come nearer to it.

    The smallest margin does not fall, and the limit of the axes is not exceeded by more than before. margins (n, M): of
    c there; those of what is returned come with it. rows ascend.
    """
    run = _Restoration(programs, c, rows, margins, keep, options)
    for k in range(options.programs):
        if not (short := run.short).any():
            break
        progress("tool axis", 0.0, f"clearing {np.count_nonzero(short)} waypoints, step {k + 1}")
        run.step(Stretches.around(shaped_by(run.basis, short), run.beside))
    return run.c, run.margins


def restored_everywhere(
    programs: AxisPrograms, c: Floats, keep: float, progress: Progress = silent
) -> tuple[Floats, Floats]:
    """Return coefficients (K, 2) near c that keep a margin, or come nearer to it, and the margins (N, M) everywhere.

    The limit of the axes comes first: they are brought within it, whatever the margins become, and stay there.
    """
    rows = np.arange(len(programs.spline.frames))
    margins = programs.values(c, rows, keep)
    if programs.beyond_own_limit(margins, keep):
        c, _ = restored(programs, c, rows, programs.values(c, rows, _ANY), _ANY, _GENTLY, progress)
        margins = programs.values(c, rows, keep)
    return restored(programs, c, rows, margins, keep, progress=progress)


class _Restoration:
    """One run. c (K, 2): the present coefficients; margins (n, M): theirs; violated (n, M): which have been short.

    beside, radii (K,): how many neighbours of each coefficient may move with it, and how far each. given_up (n,):
    waypoints that stay short whatever was tried.
    """

    def __init__(
        self,
        programs: AxisPrograms,
        c: Floats,
        rows: Ints,
        margins: Floats,
        keep: float,
        options: RestorationOptions,
    ) -> None:
        self.programs, self.rows, self.keep, self.options = programs, rows, keep, options
        self.c, self.margins, self.basis = c.copy(), margins.copy(), programs.spline.basis[rows]
        self.violated: Bools = margins < keep
        self.given_up: Bools = np.zeros(len(rows), dtype=np.bool_)
        self.beside, self.radii = np.full(len(c), options.beside), np.full(len(c), options.largest)

    @property
    def short(self) -> Bools:
        """Which waypoints (n,) are short, but for those that were given up."""
        return np.asarray(self._shortfalls(self.margins) > self.programs.options.slack) & ~self.given_up

    def _shortfalls(self, margins: Floats) -> Floats:
        """Return by how much waypoints with margins (k, M) are short (k,), 0 if they are not."""
        return np.maximum(self.keep - margins.min(axis=1), 0.0)

    def step(self, stretches: Stretches) -> None:
        """Move the coefficients of stretches, where that is better."""
        free, count = stretches.free, len(stretches.runs)
        of_rows = stretches.of_rows(self.basis)
        here = np.flatnonzero(of_rows >= 0)
        found = self._program(stretches, here).solved()
        if found is None:
            self._fail(stretches, of_rows, np.ones(count, dtype=np.bool_), self.radii[free])
            return
        c = self.c.copy()
        c[free] = within_discs(found)
        margins = self.programs.values(c, self.rows[here], self.keep)
        self.violated[here] |= margins < self.keep
        better = self._better(of_rows[here], here, margins, count)
        taken, moved = better[of_rows[here]], free[better[stretches.of_coefficients[free]]]
        lengths = np.linalg.norm(c[free] - self.c[free], axis=1)
        self.c[moved], self.margins[here[taken]] = c[moved], margins[taken]
        self.radii[moved] = np.minimum(2.0 * self.radii[moved], self.options.largest)
        self._fail(stretches, of_rows, ~better, lengths)

    def _better(self, of: Ints, here: Ints, margins: Floats, count: int) -> Bools:
        """Return which of `count` stretches are better with margins (k, M) at waypoints `here`, each of a stretch `of`.

        Waypoints that were given up do not count, but the smallest margin of a stretch must not fall, nor that to the
        limit of the axes.
        """
        before, counting = self.margins[here], ~self.given_up[here]
        first, then = (np.bincount(of, counting * self._shortfalls(each), count) for each in (before, margins))
        better = np.asarray(then <= self.options.less * first)
        for columns in (slice(None), slice(-1, None)) if self.programs.own_limit else (slice(None),):
            least, now = np.full((2, count), self.keep)
            np.minimum.at(least, of, before[:, columns].min(axis=1))
            np.minimum.at(now, of, margins[:, columns].min(axis=1))
            better &= now >= least - self.programs.options.slack
        return better

    def _fail(self, stretches: Stretches, of_rows: Ints, failing: Bools, lengths: Floats) -> None:
        """Let stretches `failing` (R,) move less, or at more coefficients; lengths (F,): of the last step.

        of_rows (n,): the stretch of each waypoint.
        """
        options, of = self.options, stretches.of_coefficients[stretches.free]
        longest = np.zeros(len(failing))
        np.maximum.at(longest, of, lengths)
        for k in np.flatnonzero(failing).tolist():
            at = slice(*stretches.runs[k])
            self.radii[at] = options.shrink * np.minimum(self.radii[at], longest[k])
            if self.radii[at].max() < options.least:
                self.radii[at] = options.largest
                self._widen(np.flatnonzero((of_rows == k) & self.short))

    def _widen(self, short: Ints) -> None:
        """Let more coefficients move around the worst of waypoints `short` (k,), or give it up."""
        options, shortfalls = self.options, self._shortfalls(self.margins[short])
        worst = short[shortfalls >= options.alike * shortfalls.max()]
        one = np.zeros(len(self.rows), dtype=np.bool_)
        one[worst] = True
        around = shaped_by(self.basis, one)
        self.beside[around] *= options.more
        if self.beside[around].max() > options.most:
            self.given_up[worst] = True

    def _program(self, stretches: Stretches, here: Ints) -> BandedQP:
        """Return the convex program of the stretches, which shape waypoints `here`, as indices of the rows."""
        here = here[~self.given_up[here]]
        programs, options, spline, free = self.programs, self.options, self.programs.spline, stretches.free
        now = Trial(self.c, self.margins[here], 0.0, self.keep)
        model = programs.model(now, self.violated[here], self.rows[here], self.radii)
        touched, point = np.unique(model.rows, return_inverse=True)
        whole = spline.basis[touched]
        basis, fixed = stretches.part_of_basis(whole, self.c)
        most = options.ask * (basis @ self.radii[free])[point] * np.linalg.norm(model.slopes, axis=1)
        needed = np.minimum(self.keep - model.values, most)
        moved = (model.slopes * (whole @ self.c - fixed)[point]).sum(axis=1)
        upper, slopes = -needed - moved, -model.slopes
        hard, short = np.flatnonzero(needed <= 0.0), np.flatnonzero(needed > 0.0)
        cost = max(spline.cost_of(self.c), options.least_cost)
        soft = _soft_rows(basis[point[short]], slopes[short], upper[short], cost / options.bearable**2)
        hessian, gradient = stretches.part_of_cost(spline.hessian, spline.gradient, self.c)
        return BandedQP(
            hessian, gradient, cost, basis, point[hard], slopes[hard], upper[hard], self.c[free], self.radii[free],
            soft, programs.options.rough,
        )  # fmt: skip


def _soft_rows(basis: Any, slopes: Floats, upper: Floats, weight: float) -> SoftRows:
    """Return the inequalities slopes[r] · (basis @ c)[r] ≤ upper[r] as soft ones, all of a weight.

    basis (R, K) sparse, NEIGHBOURS a row.
    """
    count = len(upper)
    windows = np.zeros((count, BANDS))
    by_lean = basis.data.reshape(count, NEIGHBOURS, 1) * slopes.reshape(count, 1, 2)
    windows[:, : 2 * NEIGHBOURS] = by_lean.reshape(count, 2 * NEIGHBOURS)
    starts = 2 * basis.indices[::NEIGHBOURS].astype(np.intp)
    return SoftRows(windows, starts, upper, np.full(count, weight))
