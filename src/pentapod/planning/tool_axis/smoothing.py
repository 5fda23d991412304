"""Smoothing of the tool axis: the smoothest axes that keep a margin, by sequential convex programming.

Each program holds the margins near the one to keep, to first order, and the penalty on excess. Its solution is judged
by the margins and the cost themselves, at all waypoints or at those where the spline has its nodes. Where it fails at
some places alone, it is taken elsewhere, or restored there, and the next one may move less there. In the end all
waypoints are checked; where the margin cannot be restored, they are added, and the iteration is repeated.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.base.progress import Progress, silent
from pentapod.numerics.convex.banded_qp import BandedQP
from pentapod.planning.problem.linear_model import valleys
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.tool_axis.axis_programs import AxisPrograms, MarginModel, Trial, shaped_by
from pentapod.planning.tool_axis.restoration import OPTIONS as RESTORATION
from pentapod.planning.tool_axis.restoration import restored, restored_everywhere
from pentapod.planning.tool_axis.smoothing_options import OPTIONS, SmoothingOptions
from pentapod.planning.tool_axis.spline import within_discs
from pentapod.planning.tool_axis.trust_region import TrustRegion

REPAIR = replace(RESTORATION, programs=12)
"""How steps that fail at some places are restored there."""


def smoothed(
    problem: PlacementProblem,
    start: Candidate,
    keep: float,
    options: SmoothingOptions = OPTIONS,
    progress: Progress = silent,
    leans: Floats | None = None,
) -> Floats | None:
    """Return coefficients (K, 2) of the smoothest spline of the axes that keeps the margin `keep`.

    It starts at the leans of `start`, or at `leans` (N, 3), and keeps its placement. From given leans it may keep a
    part of the margin alone (`enough`), but the whole limit of the axes. None where none was found. progress: gets a
    report after each program; how many there will be is not known.
    """
    programs = AxisPrograms(problem, start, options)
    given = programs.spline.fitted(problem.leans(start.coefficients) if leans is None else leans)
    begun, margins = restored_everywhere(programs, given, keep, progress)
    if (reached := float(margins.min())) < keep - options.slack:
        if leans is None or reached < options.enough * keep or programs.beyond_own_limit(margins, keep):
            return None
        keep = reached
    run = _Smoothing(programs, keep, progress, begun, margins, own=leans is not None)
    if leans is None:
        run.begin()
    for _ in range(options.rounds):
        found, margins = restored_everywhere(programs, run.smoothest(), keep, progress)
        if margins.min() >= keep - options.slack:
            return min((found, begun), key=programs.objective.of)
        run.add_violated(margins)
        run.return_to(begun)
    return begun


class _Smoothing:
    """One run. at: the present coefficients, which keep the margin.

    rows (n,): the active waypoints; violated (n, M): which of their margins have been short. trust: the region of the
    next program; accuracy: its.
    """

    def __init__(
        self, programs: AxisPrograms, keep: float, progress: Progress, c: Floats, margins: Floats, *, own: bool
    ) -> None:
        self.programs, self.options, self.keep = programs, programs.options, keep
        self.progress, self.solved, self.accuracy = progress, 0, self.options.rough
        self.trust = TrustRegion.of(len(c))
        # Where the axes follow the path alone, the part is near, and margins change a lot between nodes.
        rows = np.arange(len(margins)) if own else np.union1d(programs.spline.nodes, valleys(margins))
        self.begin_at(c, rows)

    def begin_at(self, c: Floats, rows: Ints) -> None:
        """Take coefficients as the present ones, and compute margins at these waypoints from now on."""
        self.rows = rows
        self.at = self.trial(c)
        self.violated: Bools = self.at.margins < self.keep

    def trial(self, c: Floats) -> Trial:
        """Return what coefficients (K, 2) have at the active waypoints."""
        return self.programs.trial(c, self.rows, self.keep)

    def add_violated(self, margins: Floats) -> None:
        """Activate the waypoints with too little margin; margins (N, M): of all."""
        worst = np.flatnonzero(margins.min(axis=1) < self.keep - self.options.slack)
        self.begin_at(self.at.c, np.union1d(self.rows, worst))

    def return_to(self, begun: Floats) -> None:
        """Go back to coefficients (K, 2) that keep the margin where the present ones do not."""
        found, self.at = self.at, self.trial(begun)
        part, _ = self.where_it_holds(found, self.failing(found))
        if self.accepts(part):
            self.at = part
        self.trust = TrustRegion.of(len(begun))

    def begin(self) -> None:
        """Start from the smoothest spline without the penalty, if its cost is lower."""
        c = self.next_program(self.model(), None).solved()
        if c is not None:
            self.at = self.taken(self.trial(within_discs(c)), np.inf)[0] or self.at

    def smoothest(self) -> Floats:
        """Return the smoothest spline that keeps the margin at the active waypoints."""
        options, slack = self.options, self.options.slack
        model, tried, since = self.model(), list[Floats](), 0
        for _ in range(options.steps):
            program, now = self.next_program(model, tried), self.at
            c = program.solved()
            if c is None:
                self.trust.shrink()
            else:
                trial = self.trial(within_discs(c))
                lengths = np.linalg.norm(trial.c - now.c, axis=1)
                predicted = program.cost_of(now.c) - program.cost_of(trial.c)
                good = now.cost - trial.cost > options.good * predicted
                taken, failing = self.taken(trial, predicted)
                if taken is not None:
                    self.at, gain = taken, now.cost - taken.cost
                    as_far = float(np.mean(lengths > 0.99 * self.trust.radii))
                    if max(gain, predicted) < options.decrease * now.cost and as_far < options.bound:
                        break  # converged
                    self.accuracy = float(np.clip(options.finer * gain / now.cost, options.fine, options.rough))
                    self.trust.after(lengths, failing, good=good)
                    model, tried = self.model(), []
                elif predicted < options.decrease * now.cost:
                    break  # no smoother one is expected
                else:
                    if trial.short > slack:
                        self.trust.shrink(lengths, failing)
                        model = self.model()
                    if good or tried:
                        tried = []
                        if not good:
                            self.trust.shrink(np.full(len(lengths), lengths.max()))
                    else:
                        tried = [trial.c]  # corrects the program once by the penalty there
            since = 0 if self.at is not now else since + 1
            if since > options.idle or self.trust.is_used_up():
                break
        return self.at.c

    def repaired(self, trial: Trial) -> Trial:
        """Return a trial that is changed where it is short, and keeps the margin there, or comes nearer to it."""
        c, margins = restored(self.programs, trial.c, self.rows, trial.margins, self.keep, REPAIR, self.progress)
        return Trial(c, margins, self.programs.objective.of(c), self.keep)

    def taken(self, trial: Trial, predicted: float) -> tuple[Trial | None, Bools]:
        """Return the trial, or what of it holds, if it is better; and the coefficients (K,) that fail.

        predicted: decrease of the cost.
        """
        if self.accepts(trial):
            return trial, np.zeros(len(trial.c), dtype=np.bool_)
        failing = self.failing(trial)
        if trial.short <= self.options.slack:
            return None, failing
        part, failing = self.where_it_holds(trial, failing)
        found = [part]
        if self.at.cost - part.cost < self.options.most * predicted:
            other = self.repaired(trial)
            found.append(self.where_it_holds(other, self.failing(other))[0])
        better = [each for each in found if self.accepts(each)]
        return min(better, key=lambda each: each.cost, default=None), failing

    def failing(self, trial: Trial) -> Bools:
        """Return the coefficients (K,) that shape waypoints where a trial is short."""
        self.violated |= trial.margins < self.keep
        return shaped_by(self.programs.spline.basis[self.rows], trial.shortfalls > self.options.slack)

    def where_it_holds(self, trial: Trial, failing: Bools) -> tuple[Trial, Bools]:
        """Return a trial without its steps where margins get too small, and the coefficients (K,) that fail."""
        part, worse, basis = trial, np.zeros(len(failing), dtype=np.bool_), self.programs.spline.basis[self.rows]
        for _ in range(self.options.tries):
            short = part.shortfalls > self.options.slack
            if not short.any():
                break
            worse |= shaped_by(basis, short)
            part = self.programs.between(self.at, trial, self.trust.away_from(worse), self.rows)
            self.violated |= part.margins < self.keep
        return part, failing | worse

    def accepts(self, trial: Trial) -> bool:
        """Return whether a trial keeps the margin and is smoother."""
        return trial.short <= self.options.slack and trial.cost < self.at.cost

    def model(self) -> MarginModel:
        """Return the linear model at the present coefficients."""
        return self.programs.model(self.at, self.violated, self.rows, self.trust.radii)

    def next_program(self, model: MarginModel, tried: list[Floats] | None) -> BandedQP:
        """Return the next convex program; the arguments as for `AxisPrograms.program`."""
        self.solved += 1
        self.progress("tool axis", 0.0, f"smoothing, step {self.solved}")
        return self.programs.program(self.at, model, self.trust.radii, tried, self.accuracy)
