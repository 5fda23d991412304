"""Dense quadratic programs against the simplex and an active-set method, and one without an interior."""

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import linprog

from pentapod.numerics.convex.dense_qp import dense_qp


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
