"""What a spline of the axes costs: charges against sums by hand, their linear model, and what they achieve."""

import casadi as ca
import numpy as np
import pytest
from planning_instances import instances

from pentapod.planning.leg_path.leg_path import leg_path
from pentapod.planning.placement.placed_path import PlacedPath, Placement
from pentapod.planning.placement.sampling import SamplingOptions, first_candidate, first_guesses
from pentapod.planning.placement.sequential import SequentialSolver
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.tilt_field import lean
from pentapod.planning.tool_axis.cost import AxisCost, CostOptions
from pentapod.planning.tool_axis.smoothing import smoothed
from pentapod.planning.tool_axis.smoothing_options import SmoothingOptions
from pentapod.planning.tool_axis.spline import BANDS, OPTIONS, AxisSpline

KEPT = 0.9
COST = CostOptions()


def candidate_of(instance, desk):
    problem = PlacementProblem.of(ToolpathSamples.of(instance.toolpath, max(instance.tilt, 0.1)), desk)
    guess = next(first_guesses(problem, options=SamplingOptions(tries=2000)))
    return problem, first_candidate(problem, guess.margins, guess.transform)


@pytest.fixture(scope="module", params=[0, 6, 11])
def made(request, desk):
    """A problem, a candidate and its cost, for a raster, a spiral and a curve."""
    problem, at = candidate_of(instances(12)[request.param], desk)
    return problem, at, AxisCost(problem, spline_of(problem), at)


def spline_of(problem):
    return AxisSpline.of(problem.samples, problem.cone)


def random_coefficients(problem, size=0.3):
    c = np.random.default_rng(0).normal(size=(spline_of(problem).hessian.shape[1] // 2, 2))
    return size * c / np.maximum(1.0, np.linalg.norm(c, axis=1, keepdims=True))


def legs_of(problem, at, desk, c):
    """Leg lengths at the nodes, by the robot's own inverse kinematics."""
    rows = spline_of(problem).nodes
    axes = lean(problem.samples.nominal, spline_of(problem).leans(c))[rows]
    tips, turned = problem.samples.machine_poses(at.transform, axes, rows)
    return desk.robot.leg_lengths(tips + desk.tool_length * turned, -turned)


def test_strict_normals_are_not_charged(made):
    problem, _, cost = made
    strict = np.zeros((spline_of(problem).hessian.shape[1] // 2, 2))
    assert cost.of(strict) == pytest.approx(spline_of(problem).cost_of(strict), rel=1e-12)
    assert cost.of(random_coefficients(problem)) > 2.0 * spline_of(problem).cost_of(random_coefficients(problem))


def test_charges_are_sums_over_the_nodes(made, desk):
    """Node by node, from lengths of the robot's own kinematics and axes themselves, in plain loops."""
    problem, at, cost = made
    c, way = random_coefficients(problem), spline_of(problem).stations

    def bent(legs):
        before, after = np.diff(way)[:-1, None], np.diff(way)[1:, None]
        return 2.0 * ((legs[2:] - legs[1:-1]) / after - (legs[1:-1] - legs[:-2]) / before) / (after + before)

    ours, strict = (np.abs(bent(legs_of(problem, at, desk, x))) for x in (c, np.zeros_like(c)))
    worst = strict.max(axis=1)
    nominal = problem.samples.nominal[spline_of(problem).nodes]
    rates = np.linalg.norm(np.diff(nominal, axis=0), axis=1) / np.diff(way)
    price = (
        CostOptions().weight * OPTIONS.foresight**2 * ((np.diff(way) * rates**2).sum() / (way[-1] - way[0]) + 0.1**2)
    )
    charge = 0.0
    for j, row in enumerate(ours):
        excess = np.maximum(row - worst[j] - 0.01 * np.median(worst), 0.0) / (worst[j] + 0.5 * np.median(worst))
        charge += price * 0.5 * (way[j + 2] - way[j]) / (way[-1] - way[0]) * (excess**2).sum()
    assert cost.of_bends.of(np.abs(cost.bends(c))) == pytest.approx(charge, rel=1e-6)


def test_rates_are_those_of_the_axes(made):
    """Told in pairs that are carried along they have the length of the axes' own, but for what lies along the axis."""
    problem, _, cost = made
    c = random_coefficients(problem, 0.05)
    rows, way = spline_of(problem).nodes, spline_of(problem).stations
    axes = lean(problem.samples.nominal, spline_of(problem).leans(c))[rows]
    true = np.linalg.norm(np.diff(axes, axis=0), axis=1) / np.diff(way)
    np.testing.assert_allclose(np.linalg.norm(cost.rates(c), axis=1), true, rtol=0.02, atol=0.02 * true.max())


def test_soft_rows_are_the_derivatives_of_what_is_charged(made):
    """Where all comes near, the charge by rows agrees with the charge itself to second order in the step."""
    problem, _, cost = made
    c, d = random_coefficients(problem), 1e-5 * random_coefficients(problem)
    rows = cost.excess(c, 2.0 * c, -2.0 * c)

    def by_rows(x):
        padded = np.append(x.ravel(), np.zeros(BANDS))
        values = (rows.windows * padded[rows.starts[:, None] + np.arange(BANDS)]).sum(axis=1)
        return float(rows.weight @ np.square(np.maximum(values - rows.upper, 0.0)))

    def charged(x):
        return cost.of(x) - spline_of(problem).cost_of(x)

    assert by_rows(c) == pytest.approx(charged(c), rel=1e-9)
    assert by_rows(c + d) - by_rows(c) == pytest.approx(charged(c + d) - charged(c), rel=1e-3)


def test_the_reference_sees_the_same_cost(made):
    problem, _, cost = made
    c = random_coefficients(problem)
    x = ca.MX.sym("c", 2, len(c))
    spent, excess, room = cost.symbolic(x)
    function = ca.Function("spent", [x, excess], [spent, room])
    lacking = -np.asarray(function(c.T, np.zeros(excess.numel()))[1]).ravel()
    found, left = function(c.T, np.maximum(_least_excess(lacking, excess.numel()), 0.0))
    assert float(found) == pytest.approx(cost.of(c), rel=1e-9)
    assert np.asarray(left).min() >= -1e-12


def _least_excess(lacking, count):
    assert len(lacking) == count  # one room for each
    return lacking


@pytest.mark.parametrize(
    "number", [pytest.param(2, marks=pytest.mark.slow), pytest.param(6, marks=pytest.mark.slow), 11]
)
def test_smooth_axes_ask_no_more_of_axis_and_legs_than_strict_normals(desk, number):
    """Along the finished path, within 10 % of the strict normals' and 1 % of their peak, but for a hundredth of it."""
    assert above_strict(desk, number) < 0.01


def test_without_charges_the_smoothest_axes_ask_more_of_the_legs(desk):
    assert above_strict(desk, 6, CostOptions(weight=1e-9)) > 0.05


def above_strict(desk, number, cost=COST):
    """Return the share of a path where a leg's acceleration is above what strict normals ask of any leg there."""
    instance = instances(12)[number]
    problem, at = candidate_of(instance, desk)
    at = SequentialSolver(problem, free=True).raise_margin(at)
    smooth = smoothed(problem, at, KEPT * at.smallest, SmoothingOptions(cost=cost))
    strict, ours = (
        accelerations(instance, problem, at, desk, axes)
        for axes in (problem.samples.nominal, lean(problem.samples.nominal, spline_of(problem).leans(smooth)))
    )
    return (ours > 1.1 * strict + 0.01 * strict.max()).mean()


def accelerations(instance, problem, at, desk, axes):
    """Largest second derivative of the legs along the path, at one density."""
    tips, turned = problem.samples.machine_poses(at.transform, axes)
    values = at.margins(tips, turned, at.transform)
    placement = Placement(at.transform, "test")
    placed = PlacedPath(instance.toolpath, placement, at.margins.scene.branch, tips, turned, values, at.margins.limits)
    path = leg_path(placed, desk, path_tolerance=20e-6, axis_tolerance=np.radians(0.5))
    parameter = np.linspace(0.0, path.length, 20_000)
    tip, axis = path.pose(parameter)
    tilt_centres = tip + problem.samples.tilt_centre * axis
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(tilt_centres, axis=0), axis=1))])
    even = np.linspace(0.0, way[-1], 4_000)
    legs = np.stack([np.interp(even, way, leg) for leg in path(parameter).T], axis=1)
    return np.abs(np.diff(legs, 2, axis=0)).max(axis=1) / even[1] ** 2
