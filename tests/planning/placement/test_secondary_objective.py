"""Weights and second aims: what they promise holds, and the derivatives that they step by are those of differences."""

import numpy as np
import pytest

from pentapod.base.errors import ArrayError
from pentapod.kinematics.forces import leg_force_map
from pentapod.planning import PlacedPath, Weights, plan
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.search import search
from pentapod.planning.placement.secondary_objective import improved, objective_of
from pentapod.planning.placement.sequential import SequentialSolver
from pentapod.planning.problem.formulation import stepped
from pentapod.planning.problem.linear_model import REACH
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.weights import NEEDED_MARGIN
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

TILT = np.radians(12.0)
AIMS = ("force", "time")


@pytest.fixture(scope="module")
def quick(cap) -> Toolpath:
    """So quick that the legs hold it back, not the feed."""
    return Toolpath((Segment(SegmentKind.CUT, cap.tips, cap.axes, 0.4),), cap.tilt_centre)


@pytest.fixture(scope="module")
def found(desk, quick):
    problem = PlacementProblem.of(ToolpathSamples.of(quick, TILT), desk)
    return problem, search(problem).best


def by_hand(name: str, machine, problem, at) -> float:
    """The aim from its meaning: the worst force of 2000 directions, or a sum over the intervals."""
    tips, axes = problem.samples.machine_poses(at.transform, problem.axes(at.coefficients))
    p = tips + machine.tool_length * axes
    if name == "force":
        rng = np.random.default_rng(0)
        pushes = rng.normal(size=(2000, 3))
        pushes /= np.linalg.norm(pushes, axis=1, keepdims=True)
        legs = np.einsum("nij,dj->ndi", leg_force_map(machine.robot, p, -axes, machine.tool_length), pushes)
        return float(np.linalg.norm(legs, axis=-1).max())
    legs = machine.robot.leg_lengths(p, -axes)
    total = 0.0
    for k in range(len(tips) - 1):
        way = float(np.linalg.norm(tips[k + 1] - tips[k]))
        total += max(way / min(0.4, machine.rapid_velocity), *(abs(legs[k + 1] - legs[k]) / machine.legs.max_velocity))
    return total


@pytest.mark.parametrize("name", [pytest.param("force", marks=pytest.mark.slow), "time"])
def test_the_second_aim_gains_and_keeps_the_margin(name, desk, quick, found):
    problem, best = found
    aim, keep = objective_of(name, problem, quick, np.arange(len(quick))), 0.9 * best.smallest
    after = improved(SequentialSolver(problem, True), best, aim, keep)
    assert after.smallest >= keep - 1e-5
    assert problem.steepness(after.coefficients).max() <= 1.0 + 1e-12
    assert aim.value(after) < 0.99 * aim.value(best)
    for candidate in (best, after):
        assert by_hand(name, desk, problem, candidate) == pytest.approx(aim.value(candidate), rel=2e-3)


@pytest.mark.parametrize("name", AIMS)
def test_derivatives_of_the_aims(name, quick, found):
    """Along random directions of all unknowns, by differences of the whole aim."""
    problem, best = found
    aim = objective_of(name, problem, quick, np.arange(len(quick)))
    model = SequentialSolver(problem, True).model(best, np.arange(len(quick)), best.smallest)
    pieces, slopes = aim.pieces(best, model)
    piece = int(pieces.argmax())
    assert aim.value(best) == pytest.approx(pieces[piece], rel=1e-12)
    for x in np.random.default_rng(1).normal(size=(3, slopes.shape[1])):

        def moved(h, x=x):
            change = (h * x[6:] * problem.cone).reshape(-1, 2)
            return problem.candidate(
                best.margins, stepped(best.transform, h * REACH * x[:6]), best.coefficients + change
            )

        slope = (aim.value(moved(1e-5)) - aim.value(moved(-1e-5))) / 2e-5
        assert slopes[piece] @ x == pytest.approx(slope, rel=1e-3, abs=1e-3 * np.abs(slopes[piece]).max())


@pytest.mark.slow
def test_even_weights_change_nothing(desk, quick):
    plain, even = (plan(quick, desk, tilt=0.0, **more) for more in ({}, {"weights": Weights()}))
    assert isinstance(plain, PlacedPath)
    assert isinstance(even, PlacedPath)
    np.testing.assert_array_equal(plain.axes, even.axes)
    np.testing.assert_array_equal(plain.placement.transform.matrix, even.placement.transform.matrix)


@pytest.mark.parametrize("solver", ["sequential", pytest.param("ipopt", marks=pytest.mark.slow)])
def test_a_weight_buys_room(solver, desk, quick):
    """At the optimum the room of the weighed group is that of the others times its weight, in both solvers."""
    answer = plan(quick, desk, tilt=0.0, weights=Weights(strokes=2.0), solver=solver)
    assert isinstance(answer, PlacedPath), str(answer)
    groups = np.array([limit.group for limit in Margins.of(desk, answer.component).limits])
    room = {g: answer.margins[:, groups == g].min() - NEEDED_MARGIN for g in set(groups)}
    others = min(room[g] for g in room if g != "strokes")
    assert room["strokes"] == pytest.approx(2.0 * others, rel=0.05)


def test_weights_are_positive():
    with pytest.raises(ArrayError, match="positive"):
        Weights(joints=0.0)
