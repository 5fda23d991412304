"""AxisPrograms: margins and cost of splines of the tool axis, and the convex programs that improve them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.numerics.convex.banded_qp import NEIGHBOURS, NO_ROWS, BandedQP, SoftRows
from pentapod.planning.problem.formulation import Slopes, lean_slopes
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.problem.tilt_field import lean
from pentapod.planning.tool_axis.cost import AxisCost
from pentapod.planning.tool_axis.smoothing_options import SmoothingOptions
from pentapod.planning.tool_axis.spline import BANDS, AxisSpline


@dataclass(frozen=True, eq=False)
class Trial:
    """Coefficients c (K, 2) of a spline, their cost, and their margins (n, M) at the active waypoints.

    keep: the margin that they should have.
    """

    c: Floats
    margins: Floats
    cost: float
    keep: float

    @cached_property
    def shortfalls(self) -> Floats:
        """By how much each active waypoint (n,) is short of the margin to keep."""
        return self.keep - self.margins.min(axis=1)

    @cached_property
    def short(self) -> float:
        """The largest shortfall."""
        return float(self.shortfalls.max())

    def aimed_at(self, keep: float, *, own_limit: bool) -> Trial:
        """Return the same for another margin to keep. own_limit: whether the last margin is the limit of the axes."""
        margins = self.margins.copy()
        if own_limit:
            margins[:, -1] += keep - self.keep
        return replace(self, margins=margins, keep=keep)


@dataclass(frozen=True, eq=False)
class MarginModel:
    """Margins near the one to keep, around coefficients c, to first order.

    active, rows (R,): the waypoint, as index into the active ones and into all; kinds, values (R,): which margin, and
    its value at c; slopes (R, 2): derivatives by the lean as a share of the cone.
    """

    c: Floats
    active: Ints
    rows: Ints
    kinds: Ints
    values: Floats
    slopes: Floats

    def missed(self, spline: AxisSpline, trial: Trial) -> Floats:
        """Return the overestimates (R,) of the linear model at a trial."""
        moved = (spline.basis @ (trial.c - self.c))[self.rows]
        predicted = self.values + (self.slopes * moved).sum(axis=1)
        return np.maximum(predicted - trial.margins[self.active, self.kinds], 0.0)


class AxisPrograms:
    """Splines of the tool axis at a candidate's placement.

    kinds (M,): which margins have been near the one to keep.
    """

    def __init__(self, problem: PlacementProblem, start: Candidate, options: SmoothingOptions) -> None:
        self.problem, self.start, self.options = problem, start, options
        self.spline = AxisSpline.of(problem.samples, problem.cone)
        self.objective = AxisCost(problem, self.spline, start, options.cost)
        self.slopes: dict[tuple[int, ...], Slopes] = {}
        self.kinds: Bools = np.zeros(len(start.margins.limits) + self.own_limit, dtype=np.bool_)

    @property
    def own_limit(self) -> bool:
        """Whether the last margin is the limit of the axes."""
        return self.problem.samples.own is not None

    def trial(self, c: Floats, rows: Ints, keep: float) -> Trial:
        """Return what coefficients (K, 2) have at waypoints `rows`."""
        return Trial(c, self.values(c, rows, keep), self.objective.of(c), keep)

    def values(self, c: Floats, rows: Ints, keep: float) -> Floats:
        """Return the margins (n, M) at waypoints `rows`; the last one is of the limit of the axes, if there is one."""
        leans, samples = self.spline.leans(c, rows), self.problem.samples
        enough = keep + 2.0 * self.options.far
        margins = self.problem.values_of(self.start.margins, self.start.transform, leans, rows, enough)
        inside = samples.inside(lean(samples.nominal[rows], leans), rows)
        return margins if inside is None else np.column_stack([margins, keep + inside])

    def between(self, now: Trial, trial: Trial, shares: Floats, rows: Ints) -> Trial:
        """Return coefficients between two trials at waypoints `rows`: moved by a share (K,) from one to the other."""
        c, margins, basis = now.c + shares[:, None] * (trial.c - now.c), trial.margins.copy(), self.spline.basis[rows]
        still, moved = ~shapes(basis, shares > 0.0), ~shapes(basis, shares < 1.0)
        margins[still] = now.margins[still]
        other = np.flatnonzero(~still & ~moved)
        margins[other] = self.values(c, rows[other], now.keep)
        return Trial(c, margins, self.objective.of(c), now.keep)

    def model(self, at: Trial, violated: Bools, active: Ints, radii: Floats) -> MarginModel:
        """Return the linear model of the margins near the one to keep, and of those that have been short.

        violated (n, M): the latter, at the waypoints `active` (n,). radii (K,): of the trust region.
        """
        spline, margins = self.spline, at.margins
        near = (margins < at.keep + self.options.near) | violated
        looked = np.flatnonzero(near.any(axis=1))
        near, rows = near[looked], active[looked]
        self.kinds |= near.any(axis=0)  # once in, always in: making their function takes longer than calling it
        kinds = np.flatnonzero(self.kinds)
        basis = spline.basis[rows]
        slopes = spline.cone * self._slopes_at(kinds, spline.cone * (basis @ at.c), rows)
        values = margins[np.ix_(looked, kinds)]
        reached = values < at.keep + self.options.spare + (basis @ radii)[:, None] * np.linalg.norm(slopes, axis=2)
        point, kind = np.nonzero(near[:, kinds] & reached)
        return MarginModel(at.c, looked[point], rows[point], kinds[kind], values[point, kind], slopes[point, kind])

    def _slopes_at(self, kinds: Ints, leans: Floats, rows: Ints) -> Floats:
        """Return the derivatives (n, K, 2) of these margins by leans (n, 2) in the frames at waypoints `rows`."""
        start, frames = self.start, self.spline.frames[rows]
        plain = tuple(kinds[kinds < len(start.margins.limits)].tolist())
        if plain not in self.slopes:
            self.slopes[plain] = lean_slopes(self.problem, start.margins, start.transform, plain)
        slopes = self.slopes[plain](frames, leans, rows)
        if len(plain) < len(kinds):  # the last one is of the limit of the axes
            slopes = np.concatenate([slopes, self.problem.samples.inside_by_lean(frames, leans, rows)[:, None]], axis=1)
        return slopes

    def program(
        self,
        at: Trial,
        model: MarginModel,
        radii: Floats,
        missed: Floats | None,
        tried: list[Floats] | None,
        accuracy: float,
        *,
        elastic: bool,
    ) -> BandedQP:
        """Return the convex program around a model at a trial, within discs of the radii (K,).

        missed: see `MarginModel.missed`; tried: coefficients at which the penalty is evaluated, besides the model's;
        None for no penalty. elastic: whether margins that are short may stay so, at a price: where two of them pull
        apart there is no solution otherwise.
        """
        spline, options = self.spline, self.options
        touched, point = np.unique(model.rows, return_inverse=True)
        basis = spline.basis[touched]
        here = (model.slopes * (basis @ model.c)[point]).sum(axis=1)
        most = options.ask * (basis @ radii)[point] * np.linalg.norm(model.slopes, axis=1)
        needed = np.minimum(at.keep - model.values + (0.0 if missed is None else missed), most)
        upper, slopes = -needed - here, -model.slopes
        soft = NO_ROWS if tried is None else self.objective.excess(model.c, *tried)
        if elastic:
            hard, short = np.flatnonzero(needed <= 0.0), np.flatnonzero(needed > 0.0)
            price = at.cost / options.bearable**2
            soft = soft.and_more(soft_rows(basis[point[short]], slopes[short], upper[short], price))
            point, slopes, upper = point[hard], slopes[hard], upper[hard]
        # Where the penalty is much larger than the spline's own cost, the accuracy is relative to both; where margins
        # stay short at a price, to the whole.
        own = at.cost if elastic else spline.cost_of(model.c)
        scale = max(float(np.sqrt(own * at.cost)), 1e-9)
        accuracy = options.rough if elastic else accuracy
        return BandedQP(
            spline.hessian, spline.gradient, scale, basis, point, slopes, upper, model.c, radii, soft, accuracy
        )


def soft_rows(basis: Any, slopes: Floats, upper: Floats, weight: float) -> SoftRows:
    """Return the inequalities slopes[r] · (basis @ c)[r] ≤ upper[r] as soft ones, all of a weight.

    basis (R, K) sparse, four neighbours a row.
    """
    count = len(upper)
    windows = np.zeros((count, BANDS))
    by_lean = basis.data.reshape(count, NEIGHBOURS, 1) * slopes.reshape(count, 1, 2)
    windows[:, : 2 * NEIGHBOURS] = by_lean.reshape(count, 2 * NEIGHBOURS)
    starts = 2 * basis.indices[::NEIGHBOURS].astype(np.intp)
    return SoftRows(windows, starts, upper, np.full(count, weight))


def shapes(basis: Any, of: Bools) -> Bools:
    """Return which rows of a sparse basis (n, K) any of the coefficients `of` (K,) shape."""
    return np.asarray(abs(basis) @ of.astype(np.float64) > 0.0)


def shaped_by(basis: Any, of: Bools) -> Bools:
    """Return which coefficients (K,) shape any of the rows `of` (n,) of a sparse basis (n, K)."""
    return shapes(abs(basis).T, of)
