"""Restoration of the margin: what changes, what stays, and what cannot be restored."""

import numpy as np
import pytest

from pentapod.geometry.rigid import RigidTransform
from pentapod.numerics.convex.banded_qp import banded_product
from pentapod.planning.limits.limit import LimitKind
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.tool_axis.axis_programs import AxisPrograms
from pentapod.planning.tool_axis.restoration import OPTIONS, restored, restored_everywhere
from pentapod.planning.tool_axis.smoothing_options import OPTIONS as SMOOTHING
from pentapod.planning.tool_axis.stretches import Stretches

KEEP = 0.1
COUNT = 400


class Ridges:
    """A limit for whose sake the axis has to lean by 8 deg along y near two places: one way, and the other."""

    name, unit, group = "ridges", "1", "bodies"

    def __init__(self, middle: float) -> None:
        self.middle = middle

    def margin(self, pose):
        along, y = pose.tip[0] - self.middle, pose.axis[1]
        near = {side: 1.0 / (1.0 + ((along - side * 0.05) / 3e-3) ** 2) ** 2 for side in (-1.0, 1.0)}
        return 0.3 + 3.0 * sum(each * (side * y - 0.2) for side, each in near.items())

    def shortfall(self, margin):
        return -margin


@pytest.fixture
def programs(desk):
    return programs_of(desk, Ridges, COUNT)


def programs_of(desk, limit, count: int) -> AxisPrograms:
    """Splines along a straight path of 200 mm with `count` waypoints."""
    here = RigidTransform(np.diag([1.0, -1.0, -1.0]), desk.work.centre)
    centres = np.c_[np.linspace(-0.1, 0.1, count), np.zeros((count, 2))]
    samples = ToolpathSamples(centres, np.tile([0.0, 0.0, 1.0], (count, 1)), 0.0, np.radians(20.0))
    limits = (LimitKind(lambda _: [limit(float(here.translation[0]))]),)
    problem = PlacementProblem.of(samples, desk, PlacementConstraints.fixture([here]), limits=limits)
    start = problem.candidate(problem.margins[0], here, problem.upright)
    return AxisPrograms(problem, start, SMOOTHING)


def everything(programs) -> tuple:
    """Upright axes, all waypoints, and their margins."""
    c, rows = np.zeros((programs.spline.basis.shape[1], 2)), np.arange(COUNT)
    return c, rows, programs.values(c, rows, KEEP)


def test_only_coefficients_near_short_waypoints_change(programs):
    c, _, before = everything(programs)
    short = np.flatnonzero(before.min(axis=1) < KEEP)
    assert 4 < len(short) < 0.2 * COUNT
    found, margins = restored_everywhere(programs, c, KEEP)
    assert margins.min() >= KEEP - SMOOTHING.slack
    np.testing.assert_array_equal(margins, programs.values(found, np.arange(COUNT), KEEP))
    moved = np.flatnonzero((found != c).any(axis=1))
    shaped = np.flatnonzero((programs.spline.basis[short].toarray() != 0.0).any(axis=0))
    assert abs(moved[:, None] - shaped).min(axis=1).max() <= OPTIONS.beside
    assert 0 < len(moved) < 0.6 * len(c)


@pytest.mark.parametrize("away", [12, 24, 60, 200])
def test_what_cannot_be_restored_does_not_keep_the_rest_from_it(away, programs):
    """At a waypoint so many from the second of the two places the margin stays where it is, whatever the lean."""
    values = programs.values
    _, rows, before = everything(programs)
    hopeless = int(np.flatnonzero(before.min(axis=1) < KEEP).max()) - away
    programs.values = lambda c, rows, keep: np.where(rows[:, None] == hopeless, -1.0, values(c, rows, keep))
    _, margins = restored(programs, *everything(programs), KEEP)
    others = rows != hopeless
    assert before[others].min() < KEEP - SMOOTHING.slack
    assert margins[others].min() >= KEEP - SMOOTHING.slack
    assert margins[hopeless].min() == -1.0


class Traded:
    """A limit that many waypoints of a place want to lean one way for, and one, which is less short, the other way."""

    name, unit, group = "traded", "1", "bodies"

    def __init__(self, middle: float) -> None:
        self.middle = middle

    def margin(self, pose):
        along, y = pose.tip[0] - self.middle, pose.axis[1]
        near, one = 1.0 / (1.0 + (along / 2e-3) ** 8), 1.0 / (1.0 + (along / 2e-4) ** 8)
        return 0.3 * (1.0 - near) + near * ((1.0 - one) * (0.085 + 0.3 * y) + one * (0.092 - 0.3 * y))

    def shortfall(self, margin):
        return -margin


def test_the_smallest_margin_does_not_fall(desk):
    """Many waypoints would gain what the worst one loses."""
    programs = programs_of(desk, Traded, 1001)
    c, rows = np.zeros((programs.spline.basis.shape[1], 2)), np.arange(1001)
    before = programs.values(c, rows, KEEP)
    assert 10 < np.count_nonzero(before.min(axis=1) < KEEP) < 40
    _, after = restored(programs, c, rows, before, KEEP)
    assert after.min() >= before.min() - SMOOTHING.slack


def test_more_coefficients_move_where_steps_of_a_few_fail(programs, monkeypatch):
    """Margins that stay short whatever the lean: more and more of the path is tried, and then it is given up."""
    values, tried = programs.values, []
    around = Stretches.around
    monkeypatch.setattr(Stretches, "around", lambda *given: tried.append(around(*given)) or tried[-1])
    programs.values = lambda c, rows, keep: np.where(rows[:, None] == 100, -1.0, values(c, rows, keep))
    restored(programs, *everything(programs), KEEP)
    widths = [int(np.ptp(each.runs[0])) for each in tried]
    assert widths[0] <= 2 * OPTIONS.beside + 6 < 2 * OPTIONS.most < max(widths)
    assert len(widths) < OPTIONS.programs


def test_leans_that_keep_the_margin_stay_as_they_are(programs):
    c, rows, margins = everything(programs)
    found, _ = restored(programs, c, rows, margins, float(margins.min()) - 0.01)
    np.testing.assert_array_equal(found, c)


@pytest.fixture
def stretches(programs):
    places = np.zeros(programs.spline.basis.shape[1], dtype=np.bool_)
    places[[0, 30, 37, 60]] = True
    return Stretches.around(places, np.full(len(places), 3))


def test_stretches_that_share_a_waypoint_are_one(stretches):
    assert stretches.runs.tolist() == [[0, 4], [27, 41], [57, 64]]
    places = np.zeros(100, dtype=np.bool_)
    places[[10, 25]] = True
    apart, together = (Stretches.around(places, np.full(100, beside)).runs.tolist() for beside in (5, 6))
    assert apart == [[5, 16], [20, 31]]  # four apart: no waypoint is shaped by both
    assert together == [[4, 32]]


def test_the_part_of_the_cost_differs_by_a_constant(programs, stretches):
    spline, rng = programs.spline, np.random.default_rng(1)
    c = 0.1 * rng.normal(size=(spline.basis.shape[1], 2))
    hessian, gradient = stretches.part_of_cost(spline.hessian, spline.gradient, c)
    costs = []
    for _ in range(3):
        other = c.copy()
        other[stretches.free] = 0.1 * rng.normal(size=(len(stretches.free), 2))
        x = other[stretches.free].ravel()
        costs.append(spline.cost_of(other) - 0.5 * x @ banded_product(hessian, x) - gradient @ x)
    np.testing.assert_allclose(costs, costs[0], rtol=1e-9)


def test_the_part_of_the_basis_gives_the_same_leans(programs, stretches):
    basis = programs.spline.basis
    rows = np.flatnonzero(stretches.of_rows(basis) >= 0)
    c = np.random.default_rng(2).normal(size=(basis.shape[1], 2))
    part, fixed = stretches.part_of_basis(basis[rows], c)
    np.testing.assert_allclose(part @ c[stretches.free] + fixed, basis[rows] @ c, atol=1e-12)
    others = np.setdiff1d(np.arange(COUNT), rows)
    assert not basis[others][:, stretches.free].toarray().any()
