"""Curvature: the Hessian of the Lagrangian, and the steps of sequential quadratic programming with it.

Where fewer limits bind than there are unknowns, the best candidate is no vertex, and linear programs would only creep
towards it. Quadratic programs with the curvature of the binding margins and leans get there in a few steps
(sequential quadratic programming: Nocedal and Wright, Numerical Optimization, ch. 18).
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

_BINDING = 1e-6
"""Multipliers from which a limit counts."""
_MOST_GAIN = 0.1
"""The most margin that a step is looked for."""


@dataclass(frozen=True, eq=False)
class Curvature:
    """The curvature of a climb's problem, whose margins are these or, with guides, these with the guides elsewhere."""

    problem: PlacementProblem
    margins: Margins
    guides: bool = False

    def best_step(self, model: LinearModel, at: Candidate, reach: float) -> tuple[Floats, Floats, float]:
        """Return the model's step (p,), the change of coefficients (size, 2), and how much margin they promise."""
        matrix, upper = model.inequalities()
        count = matrix.shape[1]
        box = np.append(np.full(count - 1, reach), _MOST_GAIN)
        near = upper < np.abs(matrix) @ box  # what is farther cannot bind
        matrix, upper = (
            np.vstack([matrix[near], np.eye(count), -np.eye(count)]),
            np.concatenate([upper[near], box, box]),
        )
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
        return _positive(self._of_margins(model, at, margins) + self._of_cone(model, at, leans))

    def _of_margins(self, model: LinearModel, at: Candidate, multipliers: Floats) -> Floats:
        problem, function = self.problem, curvature_function(self.problem, self.margins, guides=self.guides)
        binding = multipliers > _BINDING
        rows, inverse = np.unique(model.points[binding], return_inverse=True)
        weights = np.zeros((len(rows), len(at.margins.limits)))
        weights[inverse, model.kinds[binding]] = multipliers[binding]
        samples, size, (length, count) = problem.samples, 2 * problem.basis.shape[1], model.moves.shape
        total = np.zeros((count + size, count + size))
        if not len(rows):
            return total
        leans = problem.basis[rows] @ at.coefficients if size else np.zeros((len(rows), 2))
        touching = problem.contacts(at.margins, at.transform, problem.leans(at.coefficients, rows), rows)
        slid = [at.margins.machine.rail_positions - self.margins.machine.rail_positions] if self.guides else []
        for k, row in enumerate(rows):
            bent = np.asarray(
                function(
                    *slid, np.zeros(6), leans[k], samples.tilt_centres[row], samples.nominal[row],
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
        """Return how leans on the cone's edge bend: a lean of length r turns with 1/r."""
        problem, count = self.problem, model.moves.shape[1]
        size = 2 * problem.basis.shape[1]
        total = np.zeros((count + size, count + size))
        binding = np.flatnonzero(multipliers > _BINDING)
        rows = model.steep[binding]
        length = problem.steepness(at.coefficients, rows)
        aside = np.cross(problem.samples.nominal[rows], problem.leans(at.coefficients, rows))
        aside /= np.maximum(length * problem.cone, 1e-12)[:, None]
        by_unknowns = by_field(problem.basis[rows], aside @ problem.domain.lean_plane.T)
        total[count:, count:] = (by_unknowns.T * (multipliers[binding] / np.maximum(length, 1e-3))) @ by_unknowns
        return total


def _positive(matrix: Floats) -> Floats:
    """Return the symmetric matrix without its negative eigenvalues: its directions are left to the trust region."""
    values, vectors = np.linalg.eigh(matrix)
    return (vectors * np.maximum(values, 0.0)) @ vectors.T
