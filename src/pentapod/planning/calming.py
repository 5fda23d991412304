"""The default solver's second half: the calmest axes along the path that keep a margin, by convex programs in sequence.

Each program holds the margins near the one to keep to first order; its answer is judged by the margins themselves.
Where they came out short, the same program is solved once more with what the linear model had missed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.arrays import Bools, Floats, Ints
from pentapod.planning.axis_course import AxisCourse, within_discs
from pentapod.planning.formulation import Slopes, lean_slopes
from pentapod.planning.interior_point import AxisProgram
from pentapod.planning.setting import Candidate, Setting

SLACK = 1e-5
"""How far below the margin to keep calm axes may come: micrometres of a stroke."""

_STEPS = 40
_NEAR = 0.3
"""Margins within this much of the one to keep enter a program; others when they came out short."""
_ENOUGH = 2e-4
"""Of the cost: a step that gains less is the last one."""
_WHOLE, _LEAST_REACH = 2.0, 1e-3
"""Trust regions, as shares of the cone: all of it, and one in which nothing more is to be gained."""


@dataclass(frozen=True, eq=False)
class _Model:
    """Margins near the one to keep, around coefficients c, to first order.

    rows, kinds, values (R,): whose margin, which, and what it is at c; slopes (R, 2): by the lean as a share of the
    cone.
    """

    c: Floats
    rows: Ints
    kinds: Ints
    values: Floats
    slopes: Floats

    def missed(self, course: AxisCourse, trial: Floats, values: Floats) -> Floats:
        """Return by how much (R,) the linear model overrated the margins `values` (N, M) at `trial`."""
        moved = (course.basis @ (trial - self.c))[self.rows]
        promised = self.values + (self.slopes * moved).sum(axis=1)
        return np.maximum(promised - values[self.rows, self.kinds], 0.0)


def calmed(setting: Setting, start: Candidate, keep: float) -> Floats | None:
    """Return coefficients (K, 2) of the setting's course: the calmest one that keeps the margin `keep`.

    It starts at the leans of `start`, at whose placement it stays. None where no course of the axes was found to keep
    it.
    """
    return _Calming(setting, start, keep).result()


class _Calming:
    """One run. c: the coefficients so far; short: by how much they miss the margin to keep; reach: the trust region."""

    def __init__(self, setting: Setting, start: Candidate, keep: float) -> None:
        self.setting, self.course, self.start, self.keep = setting, setting.course, start, keep
        self.slopes: dict[tuple[int, ...], Slopes] = {}
        self.c = self.course.fitted(setting.leans(start.coefficients))
        self.margins = self.values(self.c)
        self.short = keep - float(self.margins.min())
        self.late: Bools = np.zeros(self.margins.shape, dtype=bool)
        self.reach = _WHOLE

    def result(self) -> Floats | None:
        """Return the calmest course, or None."""
        model, missed = self.model(), None
        for _ in range(_STEPS):
            trial = self.program(model, missed).solved()
            if trial is not None:
                trial = within_discs(trial)
                margins = self.values(trial)
                short = self.keep - float(margins.min())
                gain = self.course.cost_of(self.c) - self.course.cost_of(trial)
                if self.accepts(short, gain):
                    last = self.short <= SLACK and gain < _ENOUGH * (gain + self.course.cost_of(trial))
                    last = last and float(np.linalg.norm(trial - self.c, axis=1).max()) < 0.99 * self.reach
                    self.c, self.margins, self.short = trial, margins, short
                    if last:
                        break
                    self.reach = min(2.0 * self.reach, _WHOLE)
                    model, missed = self.model(), None
                    continue
                if short <= SLACK:  # no calmer than before
                    break
                if missed is None:  # once more, with what the model had missed and what was not in it
                    self.late |= margins < self.keep
                    model = self.model()
                    missed = model.missed(self.course, trial, margins)
                    continue
            self.reach, missed = 0.4 * self.reach, None
            if self.reach < _LEAST_REACH:
                break
        return self.c if self.short <= SLACK else None

    def accepts(self, short: float, gain: float) -> bool:
        """Tell whether a trial is better: calmer while the margin is kept, or far less short of it than before."""
        if self.short <= SLACK:
            return short <= SLACK and gain > 0.0
        return short <= max(SLACK, 0.5 * self.short)

    def values(self, c: Floats) -> Floats:
        """Return all margins (N, M)."""
        return self.setting.values_of(self.start.margins, self.start.transform, self.course.leans(c))

    def model(self) -> _Model:
        """Return the linear model of the margins near the one to keep, and of those that came out short before.

        Near ones are looked at where waypoints stand for all, the late ones anywhere.
        """
        course, start, c = self.course, self.start, self.c
        marks = np.union1d(course.marks, np.flatnonzero(self.late.any(axis=1)))
        near = (self.margins[marks] < self.keep + _NEAR) | self.late[marks]
        marks, near = marks[near.any(axis=1)], near[near.any(axis=1)]
        kinds = np.flatnonzero(near.any(axis=0))
        key = tuple(kinds.tolist())
        if key not in self.slopes:
            self.slopes[key] = lean_slopes(self.setting, start.margins, start.transform, key)
        slopes = self.slopes[key](course.frames[marks], course.cone * (course.basis[marks] @ c), marks)
        point, kind = np.nonzero(near[:, kinds])
        rows = marks[point]
        return _Model(c, rows, kinds[kind], self.margins[rows, kinds[kind]], course.cone * slopes[point, kind])

    def program(self, model: _Model, missed: Floats | None) -> AxisProgram:
        """Return the convex program around a model. missed: see `_Model.missed`."""
        course = self.course
        touched, point = np.unique(model.rows, return_inverse=True)
        basis = course.basis[touched]
        here = (model.slopes * (basis @ model.c)[point]).sum(axis=1)
        upper = model.values - self.keep - here - (0.0 if missed is None else missed)
        scale = max(course.cost_of(model.c), 1e-9)
        return AxisProgram(
            course.hessian, course.gradient, scale, basis, point, -model.slopes, upper, model.c, self.reach
        )
