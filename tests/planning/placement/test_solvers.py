"""The two solvers: the default against IPOPT on the same problem, and its linear model against differences."""

import numpy as np
import pytest
from domes import dome
from planning_instances import instances

from pentapod.geometry.rigid import RigidTransform
from pentapod.planning.placement.ipopt import IpoptSolver
from pentapod.planning.placement.sampling import SamplingOptions, first_candidate, first_guesses
from pentapod.planning.placement.search import search
from pentapod.planning.placement.sequential import SequentialOptions, SequentialSolver
from pentapod.planning.problem.formulation import stepped
from pentapod.planning.problem.linear_model import REACH
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.tilt_field import lean
from pentapod.planning.problem.weights import NEEDED_MARGIN
from pentapod.planning.tool_axis.smoothing_options import OPTIONS
from pentapod.planning.tool_axis.spline import AxisSpline

TILT = np.radians(15.0)


@pytest.fixture(scope="module")
def problem(desk):
    return PlacementProblem.of(ToolpathSamples.of(dome(0.12, 35.0, waypoints=160), TILT), desk)


@pytest.fixture(scope="module")
def start(problem, desk):
    guess = next(first_guesses(problem, options=SamplingOptions(tries=2000)))
    return first_candidate(problem, guess.margins, guess.transform)


@pytest.fixture(scope="module")
def raised(problem, start):
    return SequentialSolver(problem, free=True).raise_margin(start)


def test_a_first_candidate_keeps_the_cone(problem, start):
    assert problem.steepness(start.coefficients).max() <= 1.0 + 1e-12


def test_steps_end_where_they_hardly_raise_a_margin_that_fits(problem, start, raised):
    """The first two steps from a margin that fits are too few for a share of ten; without a share all are made."""
    ends = [
        SequentialSolver(problem, True, options=SequentialOptions(recent=2, least_gain=share)).raise_margin(start)
        for share in (10.0, 0.0)
    ]
    assert start.smallest < NEEDED_MARGIN <= ends[0].smallest < 0.99 * ends[1].smallest
    assert raised.smallest >= 0.997 * ends[1].smallest


@pytest.mark.slow
def test_the_reference_raises_a_raised_margin_no_further(problem, start, raised):
    """It is a local optimum for both solvers. From one start they may reach different ones: see the searches below."""
    assert raised.smallest > start.smallest
    reference = IpoptSolver(problem, free=True).raise_margin(raised)
    assert raised.smallest <= reference.smallest <= 1.001 * raised.smallest
    # And what the reference reaches from the start is one for the default solver.
    other = IpoptSolver(problem, free=True).raise_margin(start)
    assert SequentialSolver(problem, free=True).raise_margin(other).smallest <= 1.001 * other.smallest
    assert problem.steepness(raised.coefficients).max() <= 1.0 + 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 3, 4, 6])
def test_a_search_with_either_solver_ends_alike(desk, number):
    """From one start they may reach different tops of a landscape with many; from several the best is the same."""
    instance = instances(7)[number]
    problem = PlacementProblem.of(ToolpathSamples.of(instance.toolpath, instance.tilt), desk)
    ours, reference = search(problem), search(problem, solver="ipopt")
    assert ours.best.smallest >= 0.999 * reference.best.smallest


def test_the_result_recomputed_is_what_was_claimed(problem, raised):
    values = problem.values(raised.margins, raised.transform, raised.coefficients)
    assert values.min() == pytest.approx(raised.smallest, abs=1e-12)


def test_smoothing_reports_each_step_and_can_be_ended_there(problem, raised):
    """On a long path a step takes seconds: who waits sees that it goes on, and who cancels is heard."""

    def cancelling(stage, fraction, note):
        seen.append((stage, note))
        if len(seen) == 2:
            raise KeyboardInterrupt

    seen, keep = [], 0.9 * raised.smallest
    with pytest.raises(KeyboardInterrupt):
        SequentialSolver(problem, free=False).smooth(raised, keep, cancelling)
    assert seen == [("tool axis", "smoothing, step 1"), ("tool axis", "smoothing, step 2")]


@pytest.mark.slow
def test_smooth_axes_match_the_reference(problem, raised):
    """The same problem at a given placement: the same optimum to 0.1 %."""
    keep, spline = 0.9 * raised.smallest, AxisSpline.of(problem.samples, problem.cone)
    ours = SequentialSolver(problem, free=False).smooth(raised, keep)
    reference = IpoptSolver(problem, free=False).smooth(raised, keep)
    assert problem.values_of(raised.margins, raised.transform, spline.leans(ours)).min() >= keep - OPTIONS.slack
    assert np.linalg.norm(spline.leans(ours), axis=1).max() <= problem.cone * (1.0 + 1e-12)
    assert spline.cost_of(ours) <= 1.001 * spline.cost_of(reference)
    assert spline.cost_of(ours) < spline.cost_of(spline.fitted(problem.leans(raised.coefficients)))


def test_smooth_axes_turn_slower_than_strict_normals(problem, raised):
    ours = SequentialSolver(problem, free=False).smooth(raised, 0.9 * raised.smallest)
    axes = lean(problem.samples.nominal, AxisSpline.of(problem.samples, problem.cone).leans(ours))
    strict, turned = (np.linalg.norm(np.diff(x, axis=0), axis=1) for x in (problem.samples.nominal, axes))
    assert np.median(turned) < np.median(strict)
    assert turned.max() <= 1.1 * strict.max()


def test_no_axes_keep_a_margin_beyond_reach(problem, raised):
    assert SequentialSolver(problem, free=False).smooth(raised, raised.smallest + 0.5) is None


def test_the_linear_model_is_the_derivative(problem, raised):
    """Against central differences of the margins themselves, along random directions of all unknowns."""
    rows = np.arange(len(problem.samples.tilt_centres))
    model = SequentialSolver(problem, free=True).model(raised, rows, raised.smallest)
    rng = np.random.default_rng(3)
    for _ in range(5):
        x = rng.normal(size=model.matrix.shape[1])

        def all_values(h, x=x):
            step, change = h * x[:6] * REACH, (h * x[6:] * problem.cone).reshape(-1, 2)
            transform = stepped(raised.transform, step)
            return problem.values(raised.margins, transform, raised.coefficients + change)

        slope = (all_values(1e-6) - all_values(-1e-6)) / 2e-6
        here = all_values(0.0)
        # The model's rows are found again among all margins by their values.
        places = [np.unravel_index(np.abs(here - v).argmin(), here.shape) for v in model.values]
        expected = np.array([slope[p] for p in places])
        smooth = np.abs(model.matrix @ x - expected) < 1e-4 * (1.0 + np.abs(expected))
        assert smooth.mean() > 0.98  # gaps between legs have kinks


def test_a_fixed_placement_stays(problem, start):
    held = SequentialSolver(problem, free=False).raise_margin(start)
    np.testing.assert_array_equal(held.transform.matrix, start.transform.matrix)
    assert held.smallest >= start.smallest


def test_a_step_keeps_the_placement_rigid():
    rng = np.random.default_rng(0)
    moved = stepped(RigidTransform(np.eye(3), np.zeros(3)), rng.normal(size=6))
    np.testing.assert_allclose(moved.rotation @ moved.rotation.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(moved.rotation) == pytest.approx(1.0)
