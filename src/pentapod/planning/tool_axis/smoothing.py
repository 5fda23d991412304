"""Smoothing of the tool axis: the smoothest axes that keep a margin, by sequential convex programming.

Each program holds the margins near the one to keep, to first order, and the penalty on excess. Its answer is judged by
the margins and the cost themselves, at the waypoints where the spline has its nodes. In the end all waypoints are
checked; those with too little margin are added, and the iteration is repeated.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.numerics.convex.banded_qp import NO_ROWS, BandedQP
from pentapod.planning.problem.formulation import Slopes, lean_slopes
from pentapod.planning.problem.linear_model import valleys
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.tool_axis.cost import AxisCost, CostOptions
from pentapod.planning.tool_axis.spline import AxisSpline, within_discs

SLACK = 1e-5
"""How far below the margin to keep smooth axes may come: micrometres of a stroke."""


@dataclass(frozen=True)
class SmoothingOptions:
    """Options of the sequential convex programming.

    steps, rounds: at most so many programs, and checks at all waypoints. near: margins within this much of the one to
    keep enter a program. spare: but not those that, to first order, stay this much above it within the trust region.
    decrease: relative decrease of the cost below which the iteration stops. shortfall, saving: a step whose margin is
    short by less than `shortfall` is taken if it saves the share `saving` of the cost; the next step restores the
    margin. whole, least_reach: the largest and the smallest trust region, as shares of the cone. shorter: factor on the
    trust region after a rejected step. rough, fine, finer: accuracies of the first program and of the last, and the
    accuracy in between as a share of the gain of the step before. cost: of the penalty on excess.
    """

    steps: int = 40
    rounds: int = 8
    near: float = 0.15
    spare: float = 0.02
    decrease: float = 2e-4
    shortfall: float = 1e-2
    saving: float = 0.1
    whole: float = 2.0
    least_reach: float = 1e-3
    shorter: float = 0.4
    rough: float = 1e-3
    fine: float = 1e-6
    finer: float = 1e-2
    cost: CostOptions = field(default_factory=CostOptions)


@dataclass(frozen=True, eq=False)
class _Model:
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

    def missed(self, spline: AxisSpline, trial: Floats, values: Floats) -> Floats:
        """Return by how much (R,) the linear model overrated the margins `values` (n, M) at `trial`."""
        moved = (spline.basis @ (trial - self.c))[self.rows]
        promised = self.values + (self.slopes * moved).sum(axis=1)
        return np.maximum(promised - values[self.active, self.kinds], 0.0)


def smoothed(
    problem: PlacementProblem, start: Candidate, keep: float, options: SmoothingOptions = SmoothingOptions()
) -> Floats | None:
    """Return coefficients (K, 2) of the smoothest spline of the axes that keeps the margin `keep`.

    It starts at the leans of `start` and keeps its placement. None where no such spline was found.
    """
    run = _Smoothing(problem, start, keep, options)
    run.begin()
    for _ in range(options.rounds):
        found = run.smoothest()
        if found is None or not run.add_short_ones():
            return found
    return None


class _Smoothing:
    """One run. c: the coefficients so far; short: by how much they miss the margin to keep; spent: their cost.

    rows (n,): the active waypoints; margins (n, M): theirs, at c; late (n, M): which of them were short before; kinds
    (M,): which margins have been near the one to keep. reach: the trust region; accuracy: of the next program.
    """

    def __init__(self, problem: PlacementProblem, start: Candidate, keep: float, options: SmoothingOptions) -> None:
        self.problem, self.start, self.keep, self.options = problem, start, keep, options
        self.spline = AxisSpline.of(problem.samples, problem.cone)
        self.cost = AxisCost(problem, self.spline, start, options.cost)
        self.slopes: dict[tuple[int, ...], Slopes] = {}
        self.kinds: Bools = np.zeros(len(start.margins.limits), dtype=bool)
        self.reach, self.accuracy = self.options.whole, self.options.rough
        self.c = self.spline.fitted(problem.leans(start.coefficients))
        self.spent = self.cost.of(self.c)
        everywhere = self.values(self.c, np.arange(len(self.spline.frames)))
        self.activate(np.union1d(self.spline.nodes, valleys(everywhere)))

    def activate(self, rows: Ints) -> None:
        """Compute margins at these waypoints from now on."""
        self.rows = rows
        self.margins = self.values(self.c, rows)
        self.short = self.keep - float(self.margins.min())
        self.late: Bools = self.margins < self.keep

    def add_short_ones(self) -> bool:
        """Check all waypoints, activate those with too little margin, and return whether there were any."""
        margins = self.values(self.c, np.arange(len(self.spline.frames)))
        worst = np.flatnonzero(margins.min(axis=1) < self.keep - SLACK)
        if len(worst) > 0:
            self.activate(np.union1d(self.rows, worst))
        return len(worst) > 0

    def begin(self) -> None:
        """Start from the smoothest spline without the penalty, if that costs less."""
        trial = self.program(self.model(), None, None).solved()
        if trial is not None:
            trial = within_discs(trial)
            margins, spent = self.values(trial, self.rows), self.cost.of(trial)
            short = self.keep - float(margins.min())
            if spent < self.spent and short < max(self.short, self.options.shortfall):
                self.c, self.margins, self.short, self.spent = trial, margins, short, spent

    def smoothest(self) -> Floats | None:
        """Return the smoothest spline that keeps the margin at the active waypoints, or None."""
        model, missed, tried = self.model(), None, list[Floats]()
        for _ in range(self.options.steps):
            program = self.program(model, missed, tried)
            trial = program.solved()
            if trial is None:
                self.reach, missed = self.options.shorter * self.reach, None
            else:
                trial = within_discs(trial)
                margins, spent = self.values(trial, self.rows), self.cost.of(trial)
                short, gain = self.keep - float(margins.min()), self.spent - spent
                promise = program.cost_of(self.c) - program.cost_of(trial)
                way = float(np.linalg.norm(trial - self.c, axis=1).max())
                self.late |= margins < self.keep
                if self.accepts(short, gain):
                    last = (
                        self.short <= SLACK
                        and max(gain, promise) < self.options.decrease * self.spent
                        and way < 0.99 * self.reach
                    )
                    self.accuracy = float(
                        np.clip(self.options.finer * gain / self.spent, self.options.fine, self.options.rough)
                    )
                    self.c, self.margins, self.short, self.spent = trial, margins, short, spent
                    if last:
                        break
                    self.reach = (
                        min(2.0 * self.reach, self.options.whole)
                        if gain > 0.25 * promise
                        else max(0.5 * way, self.options.least_reach)
                    )
                    model, missed, tried = self.model(), None, []
                elif (
                    short <= SLACK and promise < self.options.decrease * self.spent
                ):  # no smoother than before, nor to be so
                    break
                elif short > SLACK and missed is None:  # once more, with what the model had missed or did not hold
                    model = self.model()
                    missed = model.missed(self.spline, trial, margins)
                elif short <= SLACK and not tried:  # once more, with the penalty at the trial
                    tried = [trial]
                else:
                    self.reach, missed = self.options.shorter * min(self.reach, way), None
            if self.reach < self.options.least_reach:
                break
        return self.c if self.short <= SLACK else None

    def accepts(self, short: float, gain: float) -> bool:
        """Return whether a trial is better: smoother and within limits, much smoother and nearly so, or less short."""
        if short <= SLACK and self.short <= SLACK:
            return gain > 0.0
        return short <= max(SLACK, 0.5 * self.short) or (
            short < self.options.shortfall and gain > self.options.saving * self.spent
        )

    def values(self, c: Floats, rows: Ints) -> Floats:
        """Return the margins (n, M) at waypoints `rows`."""
        return self.problem.values_of(self.start.margins, self.start.transform, self.spline.leans(c, rows), rows)

    def model(self) -> _Model:
        """Return the linear model of the margins near the one to keep, and of those that came out short before."""
        spline, start, c = self.spline, self.start, self.c
        near = (self.margins < self.keep + self.options.near) | self.late
        looked = np.flatnonzero(near.any(axis=1))
        near, rows = near[looked], self.rows[looked]
        self.kinds |= near.any(axis=0)  # once in, always in: making their function takes longer than calling it
        kinds = np.flatnonzero(self.kinds)
        key = tuple(kinds.tolist())
        if key not in self.slopes:
            self.slopes[key] = lean_slopes(self.problem, start.margins, start.transform, key)
        slopes = spline.cone * self.slopes[key](spline.frames[rows], spline.cone * (spline.basis[rows] @ c), rows)
        values = self.margins[np.ix_(looked, kinds)]
        reached = values < self.keep + self.options.spare + self.reach * np.linalg.norm(slopes, axis=2)
        point, kind = np.nonzero(near[:, kinds] & reached)
        return _Model(c, looked[point], rows[point], kinds[kind], values[point, kind], slopes[point, kind])

    def program(self, model: _Model, missed: Floats | None, tried: list[Floats] | None) -> BandedQP:
        """Return the convex program around a model.

        missed: see `_Model.missed`; tried: coefficients at which charges are looked for, besides the model's; None
        for no charges.
        """
        spline = self.spline
        touched, point = np.unique(model.rows, return_inverse=True)
        basis = spline.basis[touched]
        here = (model.slopes * (basis @ model.c)[point]).sum(axis=1)
        upper = model.values - self.keep - here - (0.0 if missed is None else missed)
        soft = NO_ROWS if tried is None else self.cost.excess(model.c, *tried)
        # Where the penalty is much larger than the spline's own cost, the accuracy is relative to both.
        scale = max(float(np.sqrt(spline.cost_of(model.c) * self.spent)), 1e-9)
        return BandedQP(
            spline.hessian, spline.gradient, scale, basis, point, -model.slopes, upper, model.c, self.reach, soft,
            self.accuracy,
        )  # fmt: skip
