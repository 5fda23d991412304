"""Curvature: the Hessian of the Lagrangian, and the steps of sequential quadratic programming with it.

Where fewer constraints are active than there are unknowns, the optimum is no vertex and linear programs converge
slowly. Quadratic programs with the curvature of the active margins and leans converge in a few steps (Nocedal and
Wright, Numerical Optimization, ch. 18).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.convex.dense_qp import dense_qp
from pentapod.planning.limits.margins import Margins
from pentapod.planning.problem.formulation import curvature_function
from pentapod.planning.problem.linear_model import LinearModel, by_field
from pentapod.planning.problem.problem import Candidate, PlacementProblem


@dataclass(frozen=True)
class CurvatureOptions:
    """active: multiplier above which a constraint is active. largest_gain: bound on a step's increase of the margin.

    nearest: inequalities of the first program of a step, those that a step within the trust region reaches soonest;
    those that its answer violates by more than `off` join, until none is.
    """

    active: float = 1e-4
    largest_gain: float = 0.1
    nearest: int = 240
    off: float = 1e-7


@dataclass(frozen=True, eq=False)
class Multipliers:
    """Multipliers of active constraints: margins of kinds (R,) at waypoints points (R,), and leans at steep (S,)."""

    points: Ints
    kinds: Ints
    margins: Floats
    steep: Ints
    leans: Floats

    @classmethod
    def of(cls, model: LinearModel, multipliers: Floats, active: float) -> Multipliers:
        """Return those above `active` of the multipliers (m,) of a model's inequalities."""
        margins, leans = multipliers[: len(model.values)], multipliers[len(model.values) :][: len(model.steep)]
        rows, steep = np.flatnonzero(margins > active), np.flatnonzero(leans > active)
        return cls(model.points[rows], model.kinds[rows], margins[rows], model.steep[steep], leans[steep])


@dataclass(frozen=True, eq=False)
class Step:
    """A step (p,), the change of coefficients (size, 2), their predicted increase of the margin.

    length: the largest of the unknowns, to be compared with the radius. multipliers: None where no program was solved.
    """

    move: Floats
    change: Floats
    predicted: float
    length: float = 0.0
    multipliers: Multipliers | None = None


@dataclass(frozen=True, eq=False)
class Curvature:
    """The curvature of a problem with these margins or, with guides free, with these at other rail positions."""

    problem: PlacementProblem
    margins: Margins
    guides: bool = False
    options: CurvatureOptions = CurvatureOptions()

    def best_step(self, model: LinearModel, at: Candidate, radius: float, known: Multipliers | None = None) -> Step:
        """Return the step of the largest predicted margin within a trust region of this radius.

        known: multipliers of the step before; without, they are those of a linear program.
        """
        matrix, upper = model.inequalities()
        count = matrix.shape[1]
        box = np.append(np.full(count - 1, radius), self.options.largest_gain)
        gradient, hessian = np.append(np.zeros(count - 1), -1.0), np.zeros((count, count))
        if known is None and (first := self._answer(hessian, gradient, matrix, upper, box)) is not None:
            known = Multipliers.of(model, first[1], self.options.active)
        answer = None
        if known is not None:
            hessian[:-1, :-1] = self.hessian(model, at, known)
            answer = self._answer(hessian, gradient, matrix, upper, box)
        if answer is None:
            return Step(np.zeros(len(model.moves)), np.zeros_like(at.coefficients), 0.0)
        x, multipliers = answer
        predicted = float(x[-1] - 0.5 * x @ hessian @ x)
        active = Multipliers.of(model, multipliers, self.options.active)
        return Step(*model.step_of(x[:-1]), predicted, float(np.abs(x[:-1]).max(initial=0.0)), active)

    def _answer(
        self, hessian: Floats, gradient: Floats, matrix: Floats, upper: Floats, box: Floats
    ) -> tuple[Floats, Floats] | None:
        """Return x (n,) and the multipliers (m,) of `dense_qp` within the box |x| ≤ box (n,)."""
        options, sides = self.options, np.eye(len(box))
        reached = upper / np.maximum(np.abs(matrix) @ box, 1e-300)  # where it is above 1 a row cannot be active
        chosen = reached < 1.0
        if int(chosen.sum()) > options.nearest:
            chosen = np.zeros(len(reached), dtype=np.bool_)
            chosen[np.argpartition(reached, options.nearest)[: options.nearest]] = True
        while True:
            rows = np.flatnonzero(chosen)
            answer = dense_qp(
                hessian, gradient, np.vstack([matrix[rows], sides, -sides]), np.concatenate([upper[rows], box, box])
            )
            if answer is None:
                return None
            x, found = answer
            violated = (matrix @ x > upper + options.off) & ~chosen
            if not violated.any():
                multipliers = np.zeros(len(matrix))
                multipliers[rows] = found[: len(rows)]
                return x, multipliers
            chosen |= violated

    def hessian(self, model: LinearModel, at: Candidate, multipliers: Multipliers) -> Floats:
        """Return the Lagrangian's Hessian by the unknowns x of the model, with negative eigenvalues set to zero."""
        return _positive(self.of_margins(model, at, multipliers) + self._of_cone(model, at, multipliers))

    def of_margins(self, model: LinearModel, at: Candidate, multipliers: Multipliers) -> Floats:
        """Return the Hessian of the margins, times their multipliers, by the unknowns x of the model."""
        problem, function = self.problem, curvature_function(self.problem, self.margins, guides=self.guides)
        rows, inverse = np.unique(multipliers.points, return_inverse=True)
        weights = np.zeros((len(rows), len(at.margins.limits)))
        weights[inverse, multipliers.kinds] = multipliers.margins
        samples, size, (length, count) = problem.samples, 2 * problem.basis.shape[1], model.moves.shape
        total = np.zeros((count + size, count + size))
        if not len(rows):
            return total
        leans = problem.basis[rows] @ at.coefficients if size else np.zeros((len(rows), 2))
        touching = problem.contacts(at.margins, at.transform, problem.leans(at.coefficients, rows), rows)
        offsets = (
            [at.margins.scene.machine.rail_positions - self.margins.scene.machine.rail_positions] if self.guides else []
        )
        bent = function(
            *offsets, np.zeros(6), leans, samples.tilt_centres[rows], samples.nominal[rows],
            problem.domain.lean_plane.ravel(), at.transform.rotation.T.ravel(), at.transform.translation,
            touching, weights,
        )  # fmt: skip
        by_unknowns = np.zeros((len(rows), length + 2, count + size))
        by_unknowns[:, :length, :count] = model.moves
        by_lean = problem.basis[rows][:, None, :, None] * np.eye(2)[:, None, :]
        by_unknowns[:, length:, count:] = problem.cone * by_lean.reshape(len(rows), 2, size)
        for each, by in zip(bent.reshape(len(rows), length + 2, length + 2), by_unknowns, strict=True):
            total -= by.T @ each @ by
        return total

    def _of_cone(self, model: LinearModel, at: Candidate, multipliers: Multipliers) -> Floats:
        """Return the curvature of the cone constraints: that of a lean of length r is 1/r."""
        problem, count = self.problem, model.moves.shape[1]
        size = 2 * problem.basis.shape[1]
        total = np.zeros((count + size, count + size))
        rows = multipliers.steep
        length = problem.steepness(at.coefficients, rows)
        aside = np.cross(problem.samples.nominal[rows], problem.leans(at.coefficients, rows))
        room = problem.samples.room(rows)
        aside /= np.maximum(length * problem.cone * room, 1e-12)[:, None]
        by_unknowns = by_field(problem.basis[rows] / room[:, None], aside @ problem.domain.lean_plane.T)
        total[count:, count:] = (by_unknowns.T * (multipliers.leans / np.maximum(length, 1e-3))) @ by_unknowns
        return total


def _positive(matrix: Floats) -> Floats:
    """Return the symmetric matrix with its negative eigenvalues set to 0; the trust region bounds those directions."""
    values, vectors = np.linalg.eigh(matrix)
    return (vectors * np.maximum(values, 0.0)) @ vectors.T
