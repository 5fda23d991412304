"""AxisPrograms: margins and cost of splines of the tool axis, and the convex programs that improve them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.numerics.convex.banded_qp import NO_ROWS, BandedQP
from pentapod.planning.problem.formulation import Slopes, lean_slopes
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.problem.tilt_field import lean
from pentapod.planning.tool_axis.cost import AxisCost
from pentapod.planning.tool_axis.smoothing_options import SmoothingOptions
from pentapod.planning.tool_axis.spline import AxisSpline


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


@dataclass(frozen=True, eq=False)
class MarginModel:
    """Margins near the one to keep, around coefficients c, to first order.

    rows, values (R,): the waypoint, and the value of a margin there at c; slopes (R, 2): its derivatives by the lean as
    a share of the cone.
    """

    c: Floats
    rows: Ints
    values: Floats
    slopes: Floats


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

    def beyond_own_limit(self, margins: Floats, keep: float) -> bool:
        """Return whether margins (n, M), to a margin to keep, exceed the limit of the axes."""
        return self.own_limit and float(margins[:, -1].min()) < keep - self.options.slack

    def trial(self, c: Floats, rows: Ints, keep: float) -> Trial:
        """Return what coefficients (K, 2) have at waypoints `rows`."""
        return Trial(c, self.values(c, rows, keep), self.objective.of(c), keep)

    def values(self, c: Floats, rows: Ints, keep: float) -> Floats:
        """Return the margins (n, M) at waypoints `rows`; the last one is of the limit of the axes, if there is one.

        Those to obstacles that do not enter a program may be given smaller, which takes less time.
        """
        leans, samples = self.spline.leans(c, rows), self.problem.samples
        enough = keep + 1.2 * self.options.near
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
        return MarginModel(at.c, rows[point], values[point, kind], slopes[point, kind])

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
        self, at: Trial, model: MarginModel, radii: Floats, tried: list[Floats] | None, accuracy: float
    ) -> BandedQP:
        """Return the convex program around a model at a trial that keeps the margin, within discs of the radii (K,).

        tried: coefficients at which the penalty is evaluated, besides the model's; None for no penalty.
        """
        spline = self.spline
        touched, point = np.unique(model.rows, return_inverse=True)
        basis = spline.basis[touched]
        here = (model.slopes * (basis @ model.c)[point]).sum(axis=1)
        # Margins that are short by rounding may stay so: two of them that pull apart would have no solution.
        upper = np.maximum(model.values - at.keep, 0.0) - here
        soft = NO_ROWS if tried is None else self.objective.excess(model.c, *tried)
        # Where the penalty is much larger than the spline's own cost, the accuracy is relative to both.
        scale = max(float(np.sqrt(spline.cost_of(model.c) * at.cost)), 1e-9)
        return BandedQP(
            spline.hessian, spline.gradient, scale, basis, point, -model.slopes, upper, model.c, radii, soft, accuracy
        )


def shapes(basis: Any, of: Bools) -> Bools:
    """Return which rows of a sparse basis (n, K) any of the coefficients `of` (K,) shape."""
    return np.asarray(abs(basis) @ of.astype(np.float64) > 0.0)


def shaped_by(basis: Any, of: Bools) -> Bools:
    """Return which coefficients (K,) shape any of the rows `of` (n,) of a sparse basis (n, K)."""
    return shapes(abs(basis).T, of)
