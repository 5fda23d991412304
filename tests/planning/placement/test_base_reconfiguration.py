"""Guides of a reconfigurable machine: slides chosen with the placement, against other methods of choosing them."""

import dataclasses

import numpy as np
import pytest
from domes import dome
from scipy.optimize import differential_evolution

from pentapod.base.errors import MachineError
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import Component
from pentapod.kinematics.families.general import GeneralPentapod
from pentapod.kinematics.families.reconfigurable import ReconfigurablePentapod
from pentapod.planning import plan
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.base_reconfiguration import reconfigured
from pentapod.planning.placement.curvature import Curvature, Multipliers
from pentapod.planning.placement.rail_positions import at_rail_positions
from pentapod.planning.placement.search import search
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.formulation import point_function, step_slopes, stepped
from pentapod.planning.problem.linear_model import LinearModel
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples

COMPONENT = Component.parse("++")


@pytest.fixture(scope="module")
def sliding(desk):
    """The desk machine with its base joints on guides, some of them askew."""
    turns = np.radians([90.0, 90.0, 60.0, 90.0, 120.0])
    guides = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return dataclasses.replace(desk, guides=ReconfigurablePentapod(desk.robot, guides, np.tile((-0.06, 0.06), (5, 1))))


@pytest.fixture(scope="module")
def here(desk):
    """In the middle of the work volume, upside down."""
    return RigidTransform(np.diag([1.0, -1.0, -1.0]), desk.work.centre)


def problem_of(machine, here, tilt=0.0, size=0.08, waypoints=80):
    return PlacementProblem.of(
        ToolpathSamples.of(dome(size, 25.0, waypoints), tilt), machine, PlacementConstraints.fixture([here]),
        component=COMPONENT,
    )  # fmt: skip


def test_derivatives_are_those_of_the_machine_with_its_guides_moved(sliding, here):
    """Against differences of the margins of machines that were built anew at each slide."""
    problem = problem_of(sliding.at([0.01, -0.02, 0.0, 0.015, -0.005]), here, tilt=0.2)
    margins, task = Margins.of(problem.machine, COMPONENT), problem.samples
    rng, k = np.random.default_rng(1), 7
    slid, step, a = rng.uniform(-0.01, 0.01, 5), rng.uniform(-0.02, 0.02, 6), rng.uniform(-0.1, 0.1, 2)
    pair = problem.domain.lean_plane.T

    def values(x):
        machine = sliding.at(problem.machine.rail_positions + x[6:11])
        b = pair @ x[11:]
        axis = task.nominal[k] + b - (b @ task.nominal[k]) * task.nominal[k]
        place = stepped(here, x[:6])
        turned = place.rotate(axis / np.linalg.norm(axis))
        return Margins.of(machine, COMPONENT)(place.apply(task.tilt_centres[k]) - task.tilt_centre * turned, turned)

    kinds = range(len(margins.limits))
    point = point_function(problem, margins, kinds, by="step and lean", guides=True)
    x = np.concatenate([step, slid, a])
    given = (slid, step, a, task.tilt_centres[k], task.nominal[k], pair, here.rotation, here.translation, np.zeros(0))
    found, _, slopes = (output.full() for output in point.call(list(given)))
    rows = [j for j, limit in enumerate(margins.limits) if "spindle" not in limit.name]
    np.testing.assert_allclose(np.ravel(found)[rows], values(x)[rows], atol=1e-12)
    steps = 1e-6 * np.eye(len(x))
    differences = np.stack([(values(x + h) - values(x - h)) / 2e-6 for h in steps], axis=1)
    np.testing.assert_allclose(slopes[rows], differences[rows], atol=1e-6)


def test_curvature_is_that_of_the_machine_with_its_guides_moved(sliding, here):
    """Second differences, along a line of placement, slides and tilt field, of machines built anew at each slide."""
    start = problem_of(sliding, here, tilt=0.2)
    machine = sliding.at([0.01, -0.02, 0.0, 0.015, -0.005])
    problem = start.on(machine)
    at = problem.candidate(Margins.of(machine, COMPONENT), here, problem.upright + 0.05)
    rows, moves, none = np.arange(len(problem.samples.tilt_centres)), 0.1 * np.eye(11), np.zeros(0, dtype=np.intp)
    slopes = step_slopes(start, Margins.of(sliding, COMPONENT), guides=True)
    model = LinearModel.of(problem, at, rows, np.inf, (none, none), slopes, (np.zeros(0), np.zeros((0, 11))), moves)
    rng = np.random.default_rng(5)
    strokes = np.flatnonzero(["too" in at.margins.limits[k].name for k in model.kinds])  # smooth everywhere
    multipliers = np.zeros(len(model.values) + len(model.steep))
    multipliers[rng.choice(strokes, 8, replace=False)] = rng.uniform(0.1, 1.0, 8)
    known = Multipliers.of(model, multipliers, 0.0)
    bent = Curvature(start, Margins.of(sliding, COMPONENT), guides=True).hessian(model, at, known)
    values, vectors = np.linalg.eigh(bent)

    def weighed(x):
        step, change = model.step_of(x)
        there = sliding.at(machine.rail_positions + step[6:])
        found = problem.values(Margins.of(there, COMPONENT), stepped(here, step[:6]), at.coefficients + change)
        return multipliers[: len(model.values)] @ found[model.points, model.kinds]

    assert values[0] > -1e-9 * values[-1]
    for x in vectors[:, -3:].T:  # where it bends most, nothing was left out
        h = 1e-3 * x
        second = (weighed(h) - 2.0 * weighed(0.0 * x) + weighed(-h)) / 1e-6
        assert -x @ bent @ x == pytest.approx(second, rel=1e-3)


@pytest.mark.slow
def test_slides_as_good_as_those_of_another_method(sliding, here):
    """A fixed placement, strict normals: slides alone are left to choose; against differential evolution."""
    problem = problem_of(sliding, here)
    task, least, greatest = problem.samples, *sliding.guides.travel.T
    few = task.at(task.representatives(30))
    poses = few.machine_poses(here, few.nominal)

    def cost(rail_positions):
        there = at_rail_positions(problem.margins[0], rail_positions)
        return 1.0 if there is None else -float(there(*poses).min())

    other = differential_evolution(
        cost, list(zip(least, greatest, strict=True)), maxiter=12, popsize=6, rng=3, tol=0.0, polish=False
    )
    there, found = reconfigured(problem)
    home = search(problem).best.smallest
    assert found.best.smallest >= -other.fun - 2e-3
    assert found.best.smallest > home + 0.01
    rail_positions = there.machine.rail_positions
    assert ((rail_positions >= least) & (rail_positions <= greatest)).all()
    assert there.candidate(found.best.margins, here, found.best.coefficients).smallest == found.best.smallest
    assert found.best.margins.scene.machine is there.machine


def test_a_plan_says_where_the_guides_stand(sliding, here, desk):
    path = dome(0.08, 25.0, 80)
    options = {"constraints": PlacementConstraints.fixture([here]), "component": COMPONENT}
    placed = [plan(path, sliding, **options) for _ in range(2)]
    assert placed[0].placement == placed[1].placement  # the same again
    rail_positions = placed[0].placement.rail_positions
    np.testing.assert_array_equal(np.round(rail_positions, 6), rail_positions)
    machine = sliding.at(rail_positions)
    again = Margins.of(machine, COMPONENT)(placed[0].tips, placed[0].axes)
    np.testing.assert_array_equal(again.astype(np.float32), placed[0].margins)
    fixed = plan(path, desk, **options)
    assert fixed.placement.rail_positions is None
    assert placed[0].smallest_margin > fixed.smallest_margin


def test_slides_that_cannot_be_reached_are_not_taken(sliding, here):
    """F = 0 on the way from where the guides stand: no problem there."""
    wide = dataclasses.replace(
        sliding,
        guides=ReconfigurablePentapod(sliding.robot, sliding.guides.guides, np.tile((-2.0, 2.0), (5, 1))),
    )
    problem = problem_of(wide, here)
    forbidden = wide.guides.forbidden_rail_positions(0, np.zeros(5))
    assert len(forbidden) > 0
    beyond = np.zeros(5)
    beyond[0] = forbidden[np.abs(forbidden).argmin()] * 1.5
    assert at_rail_positions(problem.margins[0], beyond) is None
    assert at_rail_positions(problem.margins[0], 0.2 * beyond) is not None


@pytest.mark.slow
def test_free_placement_and_guides(sliding):
    """Everything free: more margin than with the guides as they stand."""
    problem = PlacementProblem.of(ToolpathSamples.of(dome(0.12, 35.0), np.radians(10.0)), sliding, component=COMPONENT)
    _, found = reconfigured(problem)
    assert found.best.smallest > search(problem).best.smallest + 0.02


def test_guides_of_other_families_are_refused(sliding):
    general = GeneralPentapod(sliding.robot.base, sliding.robot.offsets + 0.01 * np.eye(5)[1])
    with pytest.raises(MachineError, match="quadratic family"):
        dataclasses.replace(sliding, robot=general)
