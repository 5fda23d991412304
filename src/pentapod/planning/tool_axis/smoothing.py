"""Smoothing of the tool axis: the smoothest axes that keep a margin, by sequential convex programming.

Each program holds the margins near the one to keep, to first order, and the penalty on excess. Its solution is judged
by the margins and the cost themselves, at the waypoints where the spline has its nodes. In the end all waypoints are
checked; those with too little margin are added, and the iteration is repeated.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.progress import Progress, silent
from pentapod.numerics.convex.banded_qp import NO_ROWS, BandedQP
from pentapod.planning.problem.formulation import Slopes, lean_slopes
from pentapod.planning.problem.linear_model import valleys
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.problem.tilt_field import lean
from pentapod.planning.tool_axis.cost import AxisCost, CostOptions
from pentapod.planning.tool_axis.spline import AxisSpline, within_discs


@dataclass(frozen=True)
class SmoothingOptions:
    """Options of the sequential convex programming.

    steps, rounds: maximum of programs, and of checks at all waypoints. slack: accepted shortfall of the margin to keep,
    micrometres of a stroke. near: margins within this distance of the one to keep enter a program. spare: except those
    that, to first order, stay this much above it within the trust region. decrease: relative decrease of the cost below
    which the iteration stops. shortfall, saving: a step whose margin is short by less than `shortfall` is accepted if
    it saves the share `saving` of the cost; the next step restores the margin. largest_radius, least_radius: of the
    trust region, as shares of the cone; next_radius: the least with which it begins for another margin to keep. good:
    ratio of actual to predicted decrease from which it is doubled; shrink: its factor after a rejected step. rough,
    fine, finer: accuracies of the first program and of the last, and the accuracy in between as a share of the relative
    decrease of the step before. levels: steps in which given leans come up to the margin to keep; enough: share of it
    that is enough where they come up no farther; far: all waypoints within this distance of it are active then. cost:
    of the penalty on excess.
    """

    steps: int = 40
    rounds: int = 8
    slack: float = 1e-5
    near: float = 0.15
    spare: float = 0.02
    decrease: float = 2e-3
    shortfall: float = 1e-2
    saving: float = 0.1
    largest_radius: float = 2.0
    least_radius: float = 1e-3
    next_radius: float = 0.5
    good: float = 0.25
    shrink: float = 0.4
    rough: float = 1e-3
    fine: float = 1e-6
    finer: float = 1e-2
    levels: int = 4
    enough: float = 0.5
    far: float = 0.3
    cost: CostOptions = field(default_factory=CostOptions)


OPTIONS = SmoothingOptions()


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
        """Return the overestimates (R,) of the linear model at `trial`, whose margins are `values` (n, M)."""
        moved = (spline.basis @ (trial - self.c))[self.rows]
        predicted = self.values + (self.slopes * moved).sum(axis=1)
        return np.maximum(predicted - values[self.active, self.kinds], 0.0)


def smoothed(
    problem: PlacementProblem,
    start: Candidate,
    keep: float,
    options: SmoothingOptions = OPTIONS,
    progress: Progress = silent,
    leans: Floats | None = None,
) -> Floats | None:
    """Return coefficients (K, 2) of the smoothest spline of the axes that keeps the margin `keep`.

    It starts at the leans of `start`, or at `leans` (N, 3), and keeps its placement. From given leans it is also the
    first spline that keeps the margin, or a part of it (`enough`), where the search for the smoothest one fails. None
    where none was found. progress: gets a report after each program; how many there will be is not known.
    """
    run = _Smoothing(problem, start, keep, options, progress, leans)
    if leans is None:
        run.begin()
    else:
        reached = run.approached()
        if reached < keep:
            return run.kept(run.c, reached) if reached >= options.enough * keep else None
    begun = run.c
    for _ in range(options.rounds):
        found = run.smoothest()
        if found is None:
            break
        if not run.add_violated():
            return found
    return None if leans is None else run.kept(begun, keep)


class _Smoothing:
    """One run. c: the present coefficients; short: their shortfall of the margin to keep; cost: theirs.

    rows (n,): the active waypoints; margins (n, M): theirs, at c; violated (n, M): which of them have been short; kinds
    (M,): which margins have been near the one to keep. radius: of the trust region; accuracy: of the next program.
    """

    def __init__(
        self,
        problem: PlacementProblem,
        start: Candidate,
        keep: float,
        options: SmoothingOptions,
        progress: Progress,
        leans: Floats | None = None,
    ) -> None:
        self.problem, self.start, self.keep, self.options = problem, start, keep, options
        self.progress, self.programs = progress, 0
        self.spline = AxisSpline.of(problem.samples, problem.cone)
        self.objective = AxisCost(problem, self.spline, start, options.cost)
        self.slopes: dict[tuple[int, ...], Slopes] = {}
        self.kinds: Bools = np.zeros(len(start.margins.limits) + (problem.samples.own is not None), dtype=bool)
        self.radius, self.accuracy = options.largest_radius, options.rough
        self.c = self.spline.fitted(problem.leans(start.coefficients) if leans is None else leans)
        self.cost = self.objective.of(self.c)
        everywhere = self.values(self.c, np.arange(len(self.spline.frames)))
        rows = np.union1d(self.spline.nodes, valleys(everywhere))
        if leans is not None:
            rows = np.union1d(rows, np.flatnonzero(everywhere.min(axis=1) < keep + options.far))
        self.activate(rows)

    def activate(self, rows: Ints) -> None:
        """Compute margins at these waypoints from now on."""
        self.rows = rows
        self.margins = self.values(self.c, rows)
        self.short = self.keep - float(self.margins.min())
        self.violated: Bools = self.margins < self.keep

    def add_violated(self) -> bool:
        """Check all waypoints, activate those with too little margin, and return whether there were any."""
        margins = self.values(self.c, np.arange(len(self.spline.frames)))
        worst = np.flatnonzero(margins.min(axis=1) < self.keep - self.options.slack)
        if len(worst) > 0:
            self.activate(np.union1d(self.rows, worst))
        return len(worst) > 0

    def begin(self) -> None:
        """Start from the smoothest spline without the penalty, if its cost is lower."""
        trial = self.program(self.model(), None, None).solved()
        if trial is not None:
            trial = within_discs(trial)
            margins, cost = self.values(trial, self.rows), self.objective.of(trial)
            short = self.keep - float(margins.min())
            if cost < self.cost and short < max(self.short, self.options.shortfall):
                self.c, self.margins, self.short, self.cost = trial, margins, short, cost

    def approached(self) -> float:
        """Come up to the margin to keep in steps, and return how far that is done.

        In one step the linear model may have no solution where the margins themselves have one.
        """
        keep, short, levels = self.keep, self.short, self.options.levels
        if short <= self.options.slack:
            return keep
        for k in range(1, levels + 1):
            self.aim(keep - short * (1.0 - k / levels))
            if self.smoothest(first=True) is None:
                return keep - short * (1.0 - (k - 1) / levels)
        return keep

    def kept(self, c: Floats, keep: float) -> Floats | None:
        """Return the first spline from coefficients (K, 2) that keeps a margin everywhere, however smooth; or None."""
        self.c, self.cost, self.keep, self.radius = c, self.objective.of(c), keep, self.options.largest_radius
        self.activate(self.rows)
        for _ in range(self.options.rounds):
            if self.short > self.options.slack and self.smoothest(first=True) is None:
                return None
            if not self.add_violated():
                return self.c
        return None

    def aim(self, keep: float) -> None:
        """Keep another margin from now on."""
        if self.problem.samples.own is not None:
            self.margins[:, -1] += keep - self.keep
        self.keep = keep
        self.radius = min(max(2.0 * self.radius, self.options.next_radius), self.options.largest_radius)
        self.short = keep - float(self.margins.min())
        self.violated = self.margins < keep

    def smoothest(self, *, first: bool = False) -> Floats | None:
        """Return the smoothest spline that keeps the margin at the active waypoints, or None.

        first: return the first one that does.
        """
        options = self.options
        model, missed, tried = self.model(), None, list[Floats]()
        for _ in range(options.steps):
            program = self.program(model, missed, tried)
            trial = program.solved()
            if trial is None:
                self.radius, missed = options.shrink * self.radius, None
            else:
                trial = within_discs(trial)
                margins, cost = self.values(trial, self.rows), self.objective.of(trial)
                short, gain = self.keep - float(margins.min()), self.cost - cost
                predicted = program.cost_of(self.c) - program.cost_of(trial)
                length = float(np.linalg.norm(trial - self.c, axis=1).max())
                self.violated |= margins < self.keep
                if self.accepts(short, gain):
                    small = max(gain, predicted) < options.decrease * self.cost
                    converged = self.short <= options.slack and small and length < 0.99 * self.radius
                    self.accuracy = float(np.clip(options.finer * gain / self.cost, options.fine, options.rough))
                    self.c, self.margins, self.short, self.cost = trial, margins, short, cost
                    if converged or (first and self.short <= options.slack):
                        break
                    if gain > options.good * predicted:
                        self.radius = min(2.0 * self.radius, options.largest_radius)
                    else:
                        self.radius = max(0.5 * length, options.least_radius)
                    model, missed, tried = self.model(), None, []
                elif short <= options.slack and predicted < options.decrease * self.cost:  # no smoother one is expected
                    break
                elif short > options.slack and missed is None:  # once more, corrected by the errors of the model
                    model = self.model()
                    missed = model.missed(self.spline, trial, margins)
                elif short <= options.slack and not tried:  # once more, with the penalty at the trial
                    tried = [trial]
                else:
                    self.radius, missed = options.shrink * min(self.radius, length), None
            if self.radius < options.least_radius:
                break
        return self.c if self.short <= options.slack else None

    def accepts(self, short: float, gain: float) -> bool:
        """Return whether a trial is better: smoother and within limits, much smoother and nearly so, or less short."""
        options = self.options
        if short <= options.slack and self.short <= options.slack:
            return gain > 0.0
        less = short <= max(options.slack, 0.5 * self.short)
        return less or (short < options.shortfall and gain > options.saving * self.cost)

    def values(self, c: Floats, rows: Ints) -> Floats:
        """Return the margins (n, M) at waypoints `rows`; the last one is of the limit of the axes, if there is one."""
        leans, samples = self.spline.leans(c, rows), self.problem.samples
        margins = self.problem.values_of(self.start.margins, self.start.transform, leans, rows)
        inside = samples.inside(lean(samples.nominal[rows], leans), rows)
        return margins if inside is None else np.column_stack([margins, self.keep + inside])

    def model(self) -> _Model:
        """Return the linear model of the margins near the one to keep, and of those that have been short."""
        spline, c = self.spline, self.c
        near = (self.margins < self.keep + self.options.near) | self.violated
        looked = np.flatnonzero(near.any(axis=1))
        near, rows = near[looked], self.rows[looked]
        self.kinds |= near.any(axis=0)  # once in, always in: making their function takes longer than calling it
        kinds = np.flatnonzero(self.kinds)
        slopes = spline.cone * self.slopes_at(kinds, spline.cone * (spline.basis[rows] @ c), rows)
        values = self.margins[np.ix_(looked, kinds)]
        reached = values < self.keep + self.options.spare + self.radius * np.linalg.norm(slopes, axis=2)
        point, kind = np.nonzero(near[:, kinds] & reached)
        return _Model(c, looked[point], rows[point], kinds[kind], values[point, kind], slopes[point, kind])

    def slopes_at(self, kinds: Ints, leans: Floats, rows: Ints) -> Floats:
        """Return the derivatives (n, K, 2) of these margins by leans (n, 2) in the frames at waypoints `rows`."""
        start, frames = self.start, self.spline.frames[rows]
        plain = tuple(kinds[kinds < len(start.margins.limits)].tolist())
        if plain not in self.slopes:
            self.slopes[plain] = lean_slopes(self.problem, start.margins, start.transform, plain)
        slopes = self.slopes[plain](frames, leans, rows)
        if len(plain) < len(kinds):  # the last one is of the limit of the axes
            slopes = np.concatenate([slopes, self.problem.samples.inside_by_lean(frames, leans, rows)[:, None]], axis=1)
        return slopes

    def program(self, model: _Model, missed: Floats | None, tried: list[Floats] | None) -> BandedQP:
        """Return the convex program around a model.

        missed: see `_Model.missed`; tried: coefficients at which the penalty is evaluated, besides the model's; None
        for no penalty.
        """
        self.programs += 1
        self.progress("tool axis", 0.0, f"smoothing, step {self.programs}")
        spline = self.spline
        touched, point = np.unique(model.rows, return_inverse=True)
        basis = spline.basis[touched]
        here = (model.slopes * (basis @ model.c)[point]).sum(axis=1)
        upper = model.values - self.keep - here - (0.0 if missed is None else missed)
        soft = NO_ROWS if tried is None else self.objective.excess(model.c, *tried)
        # Where the penalty is much larger than the spline's own cost, the accuracy is relative to both.
        scale = max(float(np.sqrt(spline.cost_of(model.c) * self.cost)), 1e-9)
        return BandedQP(
            spline.hessian, spline.gradient, scale, basis, point, -model.slopes, upper, model.c, self.radius, soft,
            self.accuracy,
        )  # fmt: skip
