"""Nodes of a jerk-limited law: where the spline of ṡ² dips below 0 between gridpoints, the law goes on moving."""

from __future__ import annotations

import numpy as np

from pentapod.timing.jerk.interval import End
from pentapod.timing.jerk.options import JerkOptions
from pentapod.timing.jerk.rows import NO_ROWS
from pentapod.timing.jerk.spline_kernels import cubic_basis
from pentapod.timing.jerk.subproblem import Subproblem
from pentapod.timing.time_law.motion_law import MotionLaw

GRID = np.linspace(0.0, 1.0, 21)


def parabola(lowest, least, step=0.0):
    """The spline x = (s − lowest)² + least, exactly, as coefficients y, and its problem without rows; least step."""
    knots = np.concatenate([[0.0] * 3, GRID[::4], [1.0] * 3])
    basis, first = np.empty((len(GRID), 3, 4)), np.empty(len(GRID), dtype=np.int64)
    cubic_basis(knots, GRID, basis, first)
    a, b, c = knots[1:-3], knots[2:-2], knots[3:-1]
    y = (a * b + b * c + c * a) / 3.0 - 2.0 * lowest * (a + b + c) / 3.0 + lowest**2 + least
    one = np.ones(len(GRID))
    return Subproblem(
        GRID, knots, basis, first, NO_ROWS, one, one, one, NO_ROWS.jerks, End(), End(), 1.0, step, JerkOptions()
    ), y


def test_a_law_goes_on_where_its_spline_dips_below_zero_between_gridpoints():
    problem, y = parabola(0.525, -0.9 * 0.025**2)
    x = problem.values(y)[:, 0]
    assert x.min() > 0.0
    assert problem.at(y, np.array([0.525]))[0, 0] < 0.0
    nodes = problem.nodes(y)
    assert (nodes.x > 0.0).all()
    assert np.isfinite(problem.seconds(y))
    law = MotionLaw.through(nodes.s, nodes.x, nodes.slope)
    assert np.isfinite(law.times).all()


def test_a_law_goes_on_where_its_spline_is_below_zero_at_a_gridpoint():
    problem, y = parabola(0.55, -1e-4)
    assert problem.values(y)[:, 0].min() < 0.0
    nodes = problem.nodes(y)
    assert (nodes.x > 0.0).all()
    assert np.isfinite(MotionLaw.through(nodes.s, nodes.x, nodes.slope).times).all()


def test_a_spline_without_dips_is_followed_at_and_between_gridpoints():
    problem, y = parabola(0.525, 1e-2)
    nodes = problem.nodes(y)
    np.testing.assert_allclose(nodes.x, (nodes.s - 0.525) ** 2 + 1e-2, rtol=1e-9)
    np.testing.assert_allclose(nodes.slope, 2.0 * (nodes.s - 0.525), atol=1e-9)


def test_nodes_that_setpoints_do_not_tell_apart_are_left_out():
    """The law hardly changes with nodes that are no closer than the least step."""
    step = 0.2
    problem, y = parabola(0.525, 1e-2)
    nodes, thin = problem.nodes(y), parabola(0.525, 1e-2, step)[0].nodes(y)
    law, other = (MotionLaw.through(each.s, each.x, each.slope) for each in (nodes, thin))
    assert np.isin(thin.s, nodes.s).all()
    assert thin.s[[0, -1]].tolist() == nodes.s[[0, -1]].tolist()
    assert len(thin.s) < 0.75 * len(nodes.s)
    assert len(thin.s) <= law.duration / step + 2.0
    assert abs(other.duration / law.duration - 1.0) < 1e-4
    t = np.linspace(0.0, law.duration, 200)
    np.testing.assert_allclose(other(t, 1), law(t, 1), atol=2e-3)


def test_between_two_ends_nearer_than_the_least_step_the_law_goes_on():
    """Both ends stand nearly still: a law of these alone would take hours."""
    problem, y = parabola(0.5, 0.0, 1e6)
    y = 0.25 - y  # x = s (1 − s)
    nodes = problem.nodes(y)
    assert 0.5 in nodes.s
    assert MotionLaw.through(nodes.s, nodes.x, nodes.slope).duration < 10.0
