"""Curvature of a placement's Lagrangian against differences of the margins."""

import numpy as np
import pytest

from pentapod.kinematics.component import Component
from pentapod.planning.placement.curvature import Curvature, CurvatureOptions, Multipliers
from pentapod.planning.placement.sampling import SamplingOptions, first_candidate, first_guesses
from pentapod.planning.placement.sequential import SequentialSolver
from pentapod.planning.problem.formulation import stepped
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples


def test_curvature_against_differences(desk, cap):
    """The Lagrangian of the margins, weighed by multipliers, along a line: second differences of the margins."""
    problem = PlacementProblem.of(ToolpathSamples.of(cap, np.radians(15.0)), desk, component=Component(1, 1))
    guess = next(first_guesses(problem, options=SamplingOptions(tries=2000)))
    at = first_candidate(problem, guess.margins, guess.transform)
    rows = np.arange(len(problem.samples.tilt_centres))
    model = SequentialSolver(problem, free=True).model(at, rows, at.smallest)
    rng = np.random.default_rng(5)
    strokes = np.flatnonzero(["too" in at.margins.limits[k].name for k in model.kinds])  # smooth everywhere
    multipliers = np.zeros(len(model.values))
    multipliers[rng.choice(strokes, 8, replace=False)] = rng.uniform(0.1, 1.0, 8)
    bent = Curvature(problem, at.margins).of_margins(model, at, Multipliers.of(model, multipliers, 0.0))

    def weighed(x):
        step, change = model.step_of(x)
        values = problem.values(at.margins, stepped(at.transform, step), at.coefficients + change)
        return multipliers @ values[model.points, model.kinds]

    for _ in range(5):
        x = rng.normal(size=model.matrix.shape[1])
        second = (weighed(1e-3 * x) - 2.0 * weighed(0.0 * x) + weighed(-1e-3 * x)) / 1e-6
        assert -x @ bent @ x == pytest.approx(second, rel=1e-3)


def test_program_of_the_nearest_inequalities_is_that_of_all(desk, cap):
    """Those that its answer violates join it, so that it predicts the same margin as with all from the start."""
    problem = PlacementProblem.of(ToolpathSamples.of(cap, np.radians(15.0)), desk, component=Component(1, 1))
    guess = next(first_guesses(problem, options=SamplingOptions(tries=2000)))
    at = first_candidate(problem, guess.margins, guess.transform)
    model = SequentialSolver(problem, free=True).model(at, np.arange(len(problem.samples.tilt_centres)), at.smallest)
    few, every = (Curvature(problem, at.margins, options=CurvatureOptions(nearest=n)) for n in (10, 100_000))
    known = every.best_step(model, at, 0.2).multipliers
    assert len(model.values) > 40
    wanted = every.best_step(model, at, 0.2, known).predicted
    assert few.best_step(model, at, 0.2, known).predicted == pytest.approx(wanted, rel=1e-4)
