"""Small convex programs against other solvers, and the curvature of a model against differences of the margins."""

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import linprog

from pentapod.kinematics.component import Component
from pentapod.numerics.convex.dense_qp import dense_qp
from pentapod.planning.placement.curvature import Curvature
from pentapod.planning.placement.sampling import SamplingOptions, first_candidate, first_guesses
from pentapod.planning.placement.sequential import SequentialSolver
from pentapod.planning.problem.formulation import stepped
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples


def program(seed, bent):
    rng = np.random.default_rng(seed)
    n, m = 12, 150
    root = rng.normal(size=(n, bent))
    matrix = np.vstack([rng.normal(size=(m, n)), np.eye(n), -np.eye(n)])
    return root @ root.T, rng.normal(size=n), matrix, np.concatenate([rng.uniform(0.0, 1.0, m), np.full(2 * n, 0.7)])


@pytest.mark.parametrize("seed", range(4))
def test_linear_programs_against_the_simplex_method(seed):
    hessian, gradient, matrix, upper = program(seed, 0)
    x, z = dense_qp(hessian, gradient, matrix, upper)
    theirs = linprog(gradient, A_ub=matrix, b_ub=upper, bounds=(None, None), method="highs-ds")
    assert gradient @ x == pytest.approx(theirs.fun, abs=1e-6)
    np.testing.assert_allclose(z, -theirs.ineqlin.marginals, atol=1e-5)


@pytest.mark.parametrize("bent", [3, 12])
@pytest.mark.parametrize("seed", range(3))
def test_quadratic_programs_against_an_active_set_method(seed, bent):
    hessian, gradient, matrix, upper = program(seed, bent)
    x, z = dense_qp(hessian, gradient, matrix, upper)
    shapes = {"h": ca.DM(hessian).sparsity(), "a": ca.DM(matrix).sparsity()}
    solver = ca.conic("theirs", "qpoases", shapes, {"printLevel": "none"})
    theirs = solver(h=hessian, g=gradient, a=matrix, uba=upper, lba=-np.inf)
    assert 0.5 * x @ hessian @ x + gradient @ x == pytest.approx(float(theirs["cost"]), abs=1e-6)
    assert (z >= 0.0).all()
    assert (matrix @ x <= upper + 1e-6).all()


def test_without_an_interior_there_is_no_answer():
    matrix = np.array([[1.0], [-1.0]])
    assert dense_qp(np.zeros((1, 1)), np.ones(1), matrix, np.array([-1.0, -1.0])) is None


def test_curvature_against_differences(desk, cap):
    """The Lagrangian of the margins, weighed by multipliers, along a line: second differences of the margins."""
    problem = PlacementProblem.of(ToolpathSamples.of(cap, np.radians(15.0)), desk, component=Component(1, 1))
    guess = first_guesses(problem, options=SamplingOptions(tries=2000))[0]
    at = first_candidate(problem, guess.margins, guess.transform)
    rows = np.arange(len(problem.samples.pivots))
    model = SequentialSolver(problem, free=True).model(at, rows, at.smallest)
    rng = np.random.default_rng(5)
    strokes = np.flatnonzero(["too" in at.margins.limits[k].name for k in model.kinds])  # smooth everywhere
    multipliers = np.zeros(len(model.values))
    multipliers[rng.choice(strokes, 8, replace=False)] = rng.uniform(0.1, 1.0, 8)
    bent = Curvature(problem, at.margins)._of_margins(model, at, multipliers)

    def weighed(x):
        step, change = model.step_of(x)
        values = problem.values(at.margins, stepped(at.transform, step), at.coefficients + change)
        return multipliers @ values[model.points, model.kinds]

    for _ in range(5):
        x = rng.normal(size=model.matrix.shape[1])
        second = (weighed(1e-3 * x) - 2.0 * weighed(0.0 * x) + weighed(-1e-3 * x)) / 1e-6
        assert -x @ bent @ x == pytest.approx(second, rel=1e-3)
