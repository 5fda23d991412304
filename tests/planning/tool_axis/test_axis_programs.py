"""Programs of the smoothing: parts of a step, and margins that may stay short."""

import numpy as np
import pytest

from pentapod.geometry.rigid import RigidTransform
from pentapod.numerics.convex.banded_qp import NO_ROWS
from pentapod.planning.limits.limit import LimitKind
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.tool_axis.axis_programs import AxisPrograms, shaped_by, shapes, soft_rows
from pentapod.planning.tool_axis.smoothing_options import OPTIONS


class Upright:
    """A limit that is nearer the more the axis leans along y."""

    name, unit, group = "upright", "1", "bodies"

    def margin(self, pose):
        return 0.2 - 3.0 * pose.axis[1]

    def shortfall(self, margin):
        return -margin


UPRIGHT = Upright()


@pytest.fixture(scope="module")
def programs(desk):
    here = RigidTransform(np.diag([1.0, -1.0, -1.0]), desk.work.centre)
    centres = np.c_[np.linspace(-0.04, 0.04, 200), np.zeros((200, 2))]
    samples = ToolpathSamples(centres, np.tile([0.0, 0.0, 1.0], (200, 1)), 3e-3, np.radians(20.0))
    limits = (LimitKind(lambda _: [UPRIGHT]),)
    problem = PlacementProblem.of(samples, desk, PlacementConstraints.fixture([here]), limits=limits)
    start = problem.candidate(problem.margins[0], here, problem.upright)
    return AxisPrograms(problem, start, OPTIONS)


def some(programs, seed):
    rng = np.random.default_rng(seed)
    return 0.3 * rng.normal(size=(programs.spline.basis.shape[1], 2)).clip(-1.0, 1.0)


def test_a_part_of_a_step_has_the_margins_of_its_coefficients(programs):
    """They are computed only where neither end has them."""
    rows = np.arange(0, 200, 3)
    now, trial = (programs.trial(some(programs, seed), rows, 0.1) for seed in (1, 2))
    shares = np.clip((np.arange(len(now.c)) - 10.0) / 8.0, 0.0, 1.0)
    asked, values = [], programs.values
    programs.values = lambda c, rows, keep: asked.append(len(rows)) or values(c, rows, keep)
    part = programs.between(now, trial, shares, rows)
    del programs.values
    again = programs.trial(part.c, rows, 0.1)
    np.testing.assert_allclose(part.margins, again.margins, atol=1e-12)
    assert part.cost == again.cost
    assert 0 < asked[0] < 0.6 * len(rows)


def test_rows_and_the_coefficients_that_shape_them(programs):
    basis = programs.spline.basis
    dense = basis.toarray() != 0.0
    of = np.zeros(basis.shape[1], dtype=np.bool_)
    of[[3, 17]] = True
    np.testing.assert_array_equal(shapes(basis, of), dense[:, of].any(axis=1))
    rows = np.arange(200) % 50 == 7
    np.testing.assert_array_equal(shaped_by(basis, rows), dense[rows].any(axis=0))


def test_soft_rows_are_the_same_inequalities(programs):
    basis, rng = programs.spline.basis[::7], np.random.default_rng(3)
    slopes, upper = rng.normal(size=(basis.shape[0], 2)), rng.normal(size=basis.shape[0])
    soft = NO_ROWS.and_more(soft_rows(basis, slopes, upper, 4.0))
    c = some(programs, 4)
    x = np.append(c.ravel(), np.zeros(soft.windows.shape[1]))
    left = [window @ x[first : first + len(window)] for window, first in zip(soft.windows, soft.starts, strict=True)]
    np.testing.assert_allclose(left, (slopes * (basis @ c)).sum(axis=1), atol=1e-12)
    both = soft.and_more(soft)
    assert len(both.upper) == len(both.windows) == 2 * len(upper)
    np.testing.assert_array_equal(both.weight, 4.0)


def pulled_apart(programs, c, *, elastic):
    """The program in which the axis should lean both ways along y at the same waypoint."""
    rows = np.arange(200)
    at = programs.trial(c, rows, 0.7)
    model = programs.model(at, np.zeros_like(at.margins, dtype=np.bool_), rows, np.full(len(c), 0.5))
    model.slopes[1::2] *= -1.0
    return programs.program(at, model, np.full(len(c), 0.5), None, None, 1e-3, elastic=elastic)


def test_margins_that_pull_apart_have_a_solution_where_they_may_stay_short(programs):
    c = np.zeros((programs.spline.basis.shape[1], 2))
    assert pulled_apart(programs, c, elastic=False).solved() is None
    found = pulled_apart(programs, c, elastic=True).solved()
    assert found is not None
    assert np.abs(found[:, 1]).max() < 0.2


def test_more_is_not_asked_of_a_margin_than_the_trust_region_allows(programs):
    """Half of it at least: what is asked has a solution, and the next program goes on from there."""
    c, rows = np.tile([0.3, 0.0], (programs.spline.basis.shape[1], 1)), np.arange(200)
    at, radii = programs.trial(c, rows, 0.25), np.full(len(c), 0.01)
    assert at.margins.argmin(axis=1).tolist() == [programs.start.margins.limits.index(UPRIGHT)] * 200
    model = programs.model(at, np.zeros_like(at.margins, dtype=np.bool_), rows, radii)
    found = programs.program(at, model, radii, None, None, 1e-6, elastic=False).solved()
    assert found is not None
    there, most = programs.trial(found, rows, 0.25), 3.0 * programs.spline.cone * 0.01
    assert at.short - most < there.short < at.short - 0.4 * most
