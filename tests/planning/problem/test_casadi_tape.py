"""Vectorised casadi functions against casadi's own evaluation, number by number."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import COMPONENTS
from pentapod.numerics.tape.vectorised import POINTS, PointByPoint, Vectorised
from pentapod.planning.limits.margins import Margins
from pentapod.planning.problem.formulation import point_function
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples

UNARY = (ca.sqrt, ca.fabs, ca.sign, ca.sin, ca.cos, ca.exp, ca.log, ca.logic_not, lambda a: -a, lambda a: a * a)
BINARY = (
    ca.fmin, ca.fmax, lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, lambda a, b: a / b,
    lambda a, b: a < b, lambda a, b: a <= b, lambda a, b: a == b, lambda a, b: a != b, ca.logic_and, ca.logic_or,
    lambda a, b: ca.if_else(a < b, 2.0 * a, 1.0 / b),
)  # fmt: skip


@given(st.integers(0, 10_000))
def test_every_operation_is_casadis(seed):
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    function = ca.Function("f", [a, b], [ca.vertcat(*[op(a) for op in UNARY], *[op(a, b) for op in BINARY])])
    values = np.random.default_rng(seed).choice([-2.5, -1.0, 0.0, 0.3, 1.0, 7.0], size=(2, 5000))
    (found,) = Vectorised(function)(values[0, :, None], values[1, :, None])
    few = values[:, :64]
    expected = np.asarray(function.map(64)(few[:1], few[1:]))
    np.testing.assert_allclose(found[:64].T, expected, rtol=0.0, atol=0.0)
    assert found.shape == (5000, len(UNARY) + len(BINARY))


@pytest.mark.parametrize("by", ["nothing", "lean", "step and lean"])
def test_margins_and_slopes_are_casadis(desk, cap, by):
    problem = PlacementProblem.of(ToolpathSamples.of(cap, 0.2), desk)
    function = point_function(problem, Margins.of(desk, COMPONENTS[0]), range(20), by=by)
    task, rng = problem.samples, np.random.default_rng(1)
    transform = RigidTransform(np.eye(3), desk.work.centre)
    count = len(task.tilt_centres)
    leans, pair = 0.1 * rng.normal(size=(count, 2)), problem.domain.lean_plane.T
    fixed = np.zeros(6), pair.T.ravel(), transform.rotation.T.ravel(), transform.translation
    touching = np.zeros((count, 0))  # there is nothing to touch
    found = Vectorised(function)(fixed[0], leans, task.tilt_centres, task.nominal, *fixed[1:], touching)
    for k in range(0, count, 37):
        row = [
            fixed[0],
            leans[k],
            task.tilt_centres[k],
            task.nominal[k],
            pair,
            transform.rotation,
            transform.translation,
        ]
        for ours, theirs in zip(found, function(*row, touching[k]), strict=True):
            np.testing.assert_array_equal(ours[k], np.asarray(theirs).ravel(order="F"))


def test_an_operation_without_counterpart_is_named():
    a = ca.SX.sym("a")
    with pytest.raises(NotImplementedError, match="operation"):
        Vectorised(ca.Function("f", [a], [ca.erf(a)]))


def test_point_by_point_is_casadis():
    """Numbers of each point, and of all; the last output, column by column."""
    a, b = ca.SX.sym("a", 2), ca.SX.sym("b", 2, 2)
    function = ca.Function("f", [a, b], [ca.dot(a, a), ca.mtimes(b, ca.horzcat(a, ca.sqrt(a)))])
    rng = np.random.default_rng(3)
    points, given = rng.uniform(1.0, 2.0, (POINTS - 5, 2)), rng.normal(size=(2, 2))
    called, expected = PointByPoint(function), np.stack([function(x, given)[1].toarray().ravel("F") for x in points])
    for _ in range(3):  # by the virtual machine, then by kernels
        np.testing.assert_array_equal(called(points, given.ravel(order="F")), expected)
