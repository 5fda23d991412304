"""Curvature: the Hessian of the Lagrangian, and the steps of sequential quadratic programming with it.

Where fewer constraints are active than there are unknowns, the optimum is no vertex and linear programs converge
slowly. Quadratic programs with the curvature of the active margins and leans converge in a few steps (Nocedal and
Wright, Numerical Optimization, ch. 18).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.convex.dense_qp import dense_qp
from pentapod.planning.limits.margins import Margins
from pentapod.planning.problem.formulation import curvature_function
from pentapod.planning.problem.linear_model import LinearModel, by_field
from pentapod.planning.problem.problem import Candidate, PlacementProblem


@dataclass(frozen=True)
class CurvatureOptions:
    """active: multiplier above which a constraint is active. largest_gain: bound on a step's increase of the margin."""

    active: float = 1e-6
    largest_gain: float = 0.1


@dataclass(frozen=True, eq=False)
class Curvature:
    """The curvature of a problem with these margins or, with guides free, with these at other rail positions."""

    problem: PlacementProblem
    margins: Margins
    guides: bool = False
    options: CurvatureOptions = CurvatureOptions()

    def best_step(self, model: LinearModel, at: Candidate, radius: float) -> tuple[Floats, Floats, float]:
        """Return the step (p,), the change of coefficients (size, 2), and their predicted increase of the margin.

        radius: of the trust region.
        """
        matrix, upper = model.inequalities()
        count = matrix.shape[1]
        box = np.append(np.full(count - 1, radius), self.options.largest_gain)
        near = upper < np.abs(matrix) @ box  # the others cannot be active
        matrix = np.vstack([matrix[near], np.eye(count), -np.eye(count)])
        upper = np.concatenate([upper[near], box, box])
        gradient, hessian = np.append(np.zeros(count - 1), -1.0), np.zeros((count, count))
        answer = dense_qp(hessian, gradient, matrix, upper)
        if answer is not None:
            multipliers = np.zeros(len(near))
            multipliers[near] = answer[1][: int(near.sum())]
            hessian[:-1, :-1] = self.hessian(model, at, multipliers)
            answer = dense_qp(hessian, gradient, matrix, upper)
        if answer is None:
            return np.zeros(len(model.moves)), np.zeros_like(at.coefficients), 0.0
        x = answer[0]
        return *model.step_of(x[:-1]), float(x[-1] - 0.5 * x @ hessian @ x)

    def hessian(self, model: LinearModel, at: Candidate, multipliers: Floats) -> Floats:
        """Return the Lagrangian's Hessian by the unknowns x of the model, with negative eigenvalues set to zero."""
        margins, leans = multipliers[: len(model.values)], multipliers[len(model.values) :][: len(model.steep)]
        return _positive(self.of_margins(model, at, margins) + self._of_cone(model, at, leans))

    def of_margins(self, model: LinearModel, at: Candidate, multipliers: Floats) -> Floats:
        """Return the Hessian of the margins, times their multipliers (R,), by the unknowns x of the model."""
        problem, function = self.problem, curvature_function(self.problem, self.margins, guides=self.guides)
        active = multipliers > self.options.active
        rows, inverse = np.unique(model.points[active], return_inverse=True)
        weights = np.zeros((len(rows), len(at.margins.limits)))
        weights[inverse, model.kinds[active]] = multipliers[active]
        samples, size, (length, count) = problem.samples, 2 * problem.basis.shape[1], model.moves.shape
        total = np.zeros((count + size, count + size))
        if not len(rows):
            return total
        leans = problem.basis[rows] @ at.coefficients if size else np.zeros((len(rows), 2))
        touching = problem.contacts(at.margins, at.transform, problem.leans(at.coefficients, rows), rows)
        offsets = (
            [at.margins.scene.machine.rail_positions - self.margins.scene.machine.rail_positions] if self.guides else []
        )
        for k, row in enumerate(rows):
            bent = np.asarray(
                function(
                    *offsets, np.zeros(6), leans[k], samples.tilt_centres[row], samples.nominal[row],
                    problem.domain.lean_plane.T, at.transform.rotation, at.transform.translation,
                    touching[k], weights[k],
                )
            )  # fmt: skip
            by_unknowns = np.zeros((length + 2, count + size))
            by_unknowns[:length, :count] = model.moves
            by_unknowns[length:, count:] = problem.cone * np.kron(problem.basis[row], np.eye(2))
            total -= by_unknowns.T @ bent @ by_unknowns
        return total

    def _of_cone(self, model: LinearModel, at: Candidate, multipliers: Floats) -> Floats:
        """Return the curvature of the cone constraints: that of a lean of length r is 1/r."""
        problem, count = self.problem, model.moves.shape[1]
        size = 2 * problem.basis.shape[1]
        total = np.zeros((count + size, count + size))
        active = np.flatnonzero(multipliers > self.options.active)
        rows = model.steep[active]
        length = problem.steepness(at.coefficients, rows)
        aside = np.cross(problem.samples.nominal[rows], problem.leans(at.coefficients, rows))
        room = problem.samples.room(rows)
        aside /= np.maximum(length * problem.cone * room, 1e-12)[:, None]
        by_unknowns = by_field(problem.basis[rows] / room[:, None], aside @ problem.domain.lean_plane.T)
        total[count:, count:] = (by_unknowns.T * (multipliers[active] / np.maximum(length, 1e-3))) @ by_unknowns
        return total


def _positive(matrix: Floats) -> Floats:
    """Return the symmetric matrix with its negative eigenvalues set to 0; the trust region bounds those directions."""
    values, vectors = np.linalg.eigh(matrix)
    return (vectors * np.maximum(values, 0.0)) @ vectors.T
