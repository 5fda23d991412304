"""Smoothing of the tool axis: the smoothest axes that keep a margin, by sequential convex programming.

Each program holds the margins near the one to keep, to first order, and the penalty on excess. Its solution is judged
by the margins and the cost themselves, at the waypoints where the spline has its nodes. Where it fails at some places
alone, it is taken elsewhere, and the next one may move less there. In the end all waypoints are checked; those with too
little margin are added, and the iteration is repeated.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.progress import Progress, silent
from pentapod.numerics.convex.banded_qp import BandedQP
from pentapod.planning.problem.linear_model import valleys
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.tool_axis.axis_programs import AxisPrograms, MarginModel, Trial, shaped_by
from pentapod.planning.tool_axis.smoothing_options import OPTIONS, SmoothingOptions
from pentapod.planning.tool_axis.spline import within_discs
from pentapod.planning.tool_axis.trust_region import TrustRegion


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
    run = _Smoothing(AxisPrograms(problem, start, options), keep, progress, leans)
    if leans is None:
        run.begin()
    else:
        reached = run.approached()
        if reached < keep:
            return run.kept(run.at.c, reached) if reached >= options.enough * keep else None
    begun = run.at.c
    for _ in range(options.rounds):
        found = run.smoothest()
        if found is None:
            break
        if not run.add_violated():
            return found
        run.return_to(begun)
    return None if leans is None else run.kept(begun, keep)


class _Smoothing:
    """One run. at: the present coefficients.

    rows (n,): the active waypoints; violated (n, M): which of their margins have been short. trust: the region of the
    next program; accuracy: its; elastic: whether it may leave margins short.
    """

    def __init__(self, programs: AxisPrograms, keep: float, progress: Progress, leans: Floats | None = None) -> None:
        self.programs, self.options, self.keep = programs, programs.options, keep
        self.progress, self.solved, self.accuracy = progress, 0, self.options.rough
        self.elastic = False
        spline, start = programs.spline, programs.start
        c = spline.fitted(programs.problem.leans(start.coefficients) if leans is None else leans)
        self.trust = TrustRegion.of(len(c))
        everywhere = programs.values(c, np.arange(len(spline.frames)), keep)
        rows = np.union1d(spline.nodes, valleys(everywhere))
        if leans is not None:
            rows = np.union1d(rows, np.flatnonzero(everywhere.min(axis=1) < keep + self.options.far))
        self.begin_at(c, rows)

    def begin_at(self, c: Floats, rows: Ints) -> None:
        """Take coefficients as the present ones, and compute margins at these waypoints from now on."""
        self.rows = rows
        self.at = self.trial(c)
        self.violated: Bools = self.at.margins < self.keep

    def trial(self, c: Floats) -> Trial:
        """Return what coefficients (K, 2) have at the active waypoints."""
        return self.programs.trial(c, self.rows, self.keep)

    def add_violated(self) -> bool:
        """Check all waypoints, activate those with too little margin, and return whether there were any."""
        margins = self.programs.values(self.at.c, np.arange(len(self.programs.spline.frames)), self.keep)
        worst = np.flatnonzero(margins.min(axis=1) < self.keep - self.options.slack)
        if len(worst) > 0:
            self.begin_at(self.at.c, np.union1d(self.rows, worst))
        return len(worst) > 0

    def return_to(self, begun: Floats) -> None:
        """Go back to coefficients (K, 2) that keep the margin, if they do, where the present ones do not."""
        found, start = self.at, self.trial(begun)
        if start.short > self.options.slack:
            return
        self.at = start
        part, _ = self.where_it_holds(found, self.failing(found))
        if self.accepts(part):
            self.at = part

    def begin(self) -> None:
        """Start from the smoothest spline without the penalty, if its cost is lower."""
        c = self.next_program(self.model(), None, None).solved()
        if c is not None:
            trial = self.trial(within_discs(c))
            if trial.cost < self.at.cost and trial.short < max(self.at.short, self.options.shortfall):
                self.at = trial

    def approached(self) -> float:
        """Come up to the margin to keep in steps, and return how far that is done.

        In one step the linear model may have no solution where the margins themselves have one.
        """
        keep, short, levels = self.keep, self.at.short, self.options.levels
        if short <= self.options.slack:
            return keep
        for k in range(1, levels + 1):
            self.aim(keep - short * (1.0 - k / levels))
            if self.smoothest(first=True) is None:
                return keep - short * (1.0 - (k - 1) / levels)
        return keep

    def kept(self, c: Floats, keep: float) -> Floats | None:
        """Return the first spline from coefficients (K, 2) that keeps a margin everywhere, however smooth; or None."""
        self.keep, self.trust = keep, TrustRegion.of(len(c))
        self.begin_at(c, self.rows)
        for _ in range(self.options.rounds):
            if self.at.short > self.options.slack and self.smoothest(first=True) is None:
                return None
            if not self.add_violated():
                return self.at.c
        return None

    def aim(self, keep: float) -> None:
        """Keep another margin from now on."""
        self.at, self.keep = self.at.aimed_at(keep, own_limit=self.programs.own_limit), keep
        self.trust.widen(self.options.next_radius)
        self.violated = self.at.margins < keep

    def smoothest(self, *, first: bool = False) -> Floats | None:
        """Return the smoothest spline that keeps the margin at the active waypoints, or None.

        first: return the first one that does.
        """
        options, slack = self.options, self.options.slack
        model, missed, tried = self.model(), None, list[Floats]()
        best, since = self.at if self.at.short <= slack else None, 0
        self.elastic = False
        for k in range(options.steps + options.back):
            if k >= options.steps and self.at.short <= slack:
                break
            program, now = self.next_program(model, missed, tried), self.at
            c = program.solved()
            if c is None:
                if self.elastic or self.at.short <= slack:
                    self.trust.shrink()
                self.elastic, missed = self.at.short > slack, None
            else:
                trial = self.trial(within_discs(c))
                lengths = np.linalg.norm(trial.c - self.at.c, axis=1)
                predicted = -np.inf if self.elastic else program.cost_of(self.at.c) - program.cost_of(trial.c)
                taken, failing = self.taken(trial, predicted, again=missed is not None)
                if taken is not None:
                    gain = now.cost - taken.cost
                    self.at, best = taken, taken if taken.short <= slack else best
                    if first and taken.short <= slack:
                        break
                    small = max(gain, predicted) < options.decrease * now.cost
                    if small and now.short <= slack and (lengths < 0.99 * self.trust.radii).all():  # converged
                        break
                    self.elastic = False
                    self.accuracy = float(np.clip(options.finer * gain / now.cost, options.fine, options.rough))
                    # A step that restores the margin may cost something: not much more than was expected.
                    least = min(options.good * predicted, predicted / options.good)
                    self.trust.after(lengths, failing, good=gain > least)
                    model, missed, tried = self.model(), None, []
                elif trial.short <= slack and predicted < options.decrease * self.at.cost:
                    break  # no smoother one is expected
                else:
                    model, missed, tried = self.corrected(trial, lengths, failing, (model, missed, tried))
            since = 0 if self.at is not now else since + 1
            if since > options.idle or self.trust.is_used_up(self.shaping(self.at.shortfalls > slack)):
                break
        self.at = best or self.at
        return self.at.c if self.at.short <= slack else None

    def taken(self, trial: Trial, predicted: float, *, again: bool) -> tuple[Trial | None, Bools]:
        """Return the trial, or the part of it that holds, if it is better; and the coefficients (K,) that fail.

        predicted: decrease of the cost. again: whether the program was corrected by the errors of the model already.
        """
        if self.accepts(trial):
            return trial, np.zeros(len(trial.c), dtype=np.bool_)
        failing = self.failing(trial)
        if trial.short <= self.options.slack:
            return None, failing
        part, failing = self.where_it_holds(trial, failing)
        enough = again or self.at.cost - part.cost > self.options.most * predicted
        return part if enough and self.accepts(part) else None, failing

    def corrected(
        self, trial: Trial, lengths: Floats, failing: Bools, last: tuple[MarginModel, Floats | None, list[Floats]]
    ) -> tuple[MarginModel, Floats | None, list[Floats]]:
        """Return model, errors and tried coefficients of the program after a trial that was not taken.

        It is corrected once by the errors of the margins, and once by the penalty at the trial. Then trust shrinks.
        """
        model, missed, tried = last
        if trial.short > self.options.slack:
            if missed is None:
                model = self.model()
                return model, model.missed(self.programs.spline, trial), tried
            self.trust.shrink(lengths, failing)
        elif not tried:
            return model, missed, [trial.c]
        else:
            self.trust.shrink(np.full(len(lengths), lengths.max()))
        return model, None, tried

    def shaping(self, short: Bools) -> Bools:
        """Return the coefficients (K,) that shape active waypoints `short` (n,); all where there are none."""
        if not short.any():
            return np.ones(len(self.at.c), dtype=np.bool_)
        return shaped_by(self.programs.spline.basis[self.rows], short)

    def failing(self, trial: Trial) -> Bools:
        """Return the coefficients (K,) at waypoints where a trial is short, and not much less so than now."""
        self.violated |= trial.margins < self.keep
        short = trial.shortfalls > np.maximum(self.options.less * self.at.shortfalls, self.options.slack)
        return shaped_by(self.programs.spline.basis[self.rows], short)

    def where_it_holds(self, trial: Trial, failing: Bools) -> tuple[Trial, Bools]:
        """Return a trial without its steps where margins get too small, and the coefficients (K,) that fail."""
        part, worse, basis = trial, np.zeros(len(failing), dtype=np.bool_), self.programs.spline.basis[self.rows]
        for _ in range(self.options.tries):
            short = part.shortfalls > np.maximum(self.at.shortfalls, self.options.slack)
            if not short.any():
                break
            worse |= shaped_by(basis, short)
            part = self.programs.between(self.at, trial, self.trust.away_from(worse), self.rows)
            self.violated |= part.margins < self.keep
        return part, failing | worse

    def accepts(self, trial: Trial) -> bool:
        """Return whether a trial is better: smoother and within limits, much smoother and nearly so, or less short."""
        options, now, gain = self.options, self.at, self.at.cost - trial.cost
        if max(trial.short, now.short) <= options.slack:
            return gain > 0.0
        if trial.short <= max(options.slack, 0.5 * now.short):
            return True
        before, after = (float(np.maximum(each.shortfalls, 0.0).sum()) for each in (now, trial))
        less = trial.short <= now.short and after <= options.less * before
        return less or (trial.short < options.shortfall and gain > options.saving * now.cost)

    def model(self) -> MarginModel:
        """Return the linear model at the present coefficients."""
        return self.programs.model(self.at, self.violated, self.rows, self.trust.radii)

    def next_program(self, model: MarginModel, missed: Floats | None, tried: list[Floats] | None) -> BandedQP:
        """Return the next convex program; the arguments as for `AxisPrograms.program`."""
        self.solved += 1
        self.progress("tool axis", 0.0, f"smoothing, step {self.solved}")
        return self.programs.program(
            self.at, model, self.trust.radii, missed, tried, self.accuracy, elastic=self.elastic
        )
