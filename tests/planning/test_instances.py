"""Many random tasks: planned with every limit kept, or refused with a cause that brute force does not refute."""

from pathlib import Path

import numpy as np
import pytest
from planning_instances import Instance, instances, machine

from pentapod.base.refusal import Refusal
from pentapod.machine.clearance.collision_world import NOTHING
from pentapod.machine.machine import Machine
from pentapod.planning import LegPath, PlacedPath, leg_path, plan
from pentapod.planning.placement.sampling import SamplingOptions, best_tilted_margins, first_guesses
from pentapod.planning.plan import NEEDED_MARGIN
from pentapod.planning.problem.constraints import FREE
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.program import Provenance, sample, write_csv
from pentapod.timing import Trajectory, retime
from pentapod.verify import verify

FEW, MANY = instances(2), instances(300)
CLEARLY_FEASIBLE = 0.05
AXIS_TOLERANCE = np.radians(0.5)


def brute_force(instance: Instance, machine: Machine, samples: int) -> float:
    """Return the best smallest margin of random placements with each waypoint's tilt chosen by itself."""
    task = ToolpathSamples.of(instance.toolpath, instance.tilt)
    guesses = first_guesses(PlacementProblem.of(task, machine), seed=99, options=SamplingOptions(tries=samples))
    return max(best_tilted_margins(task, g.margins, g.transform)[0].min() for g in guesses)


def check(instance: Instance, samples: int, folder: Path) -> bool:
    """Return whether a task was planned as it should be, with every claim about its program certified.

    What may never be, such as limits that are not kept, or a refusal without its cause, is asserted.
    """
    robot = machine(instance.machine)
    answer = plan(instance.toolpath, robot, tilt=instance.tilt)
    if isinstance(answer, Refusal):
        assert answer.diagnosis
        assert all(each.waypoints and each.shortfall > 0.0 for each in answer.diagnosis)
        return brute_force(instance, robot, samples) < CLEARLY_FEASIBLE
    assert isinstance(answer, PlacedPath)
    p, i = answer.tips + robot.tool_length * answer.axes, -answer.axes
    legs = robot.robot.leg_lengths(p, i)
    assert ((legs > robot.legs.min_length) & (legs < robot.legs.max_length)).all()
    np.testing.assert_array_equal(robot.robot.branch(p, i), np.tile(answer.component, (len(p), 1)))
    nominal = answer.placement.transform.rotate(instance.toolpath.axes)
    assert (np.cross(answer.axes, nominal) ** 2).sum(axis=1).max() <= np.sin(instance.tilt) ** 2 + 1e-12
    return answer.smallest_margin >= 0.8 * NEEDED_MARGIN and certified(answer, robot, instance, folder)


def certified(placed: PlacedPath, robot: Machine, instance: Instance, folder: Path) -> bool:
    """Return whether the verdict passes on a plan's program, read from its file."""
    path = leg_path(placed, robot, path_tolerance=20e-6, axis_tolerance=AXIS_TOLERANCE)
    assert isinstance(path, LegPath)
    trajectory = retime(path, robot)
    assert isinstance(trajectory, Trajectory)
    source = Provenance(robot.name, robot.digest, "test", "test")
    file = folder / "program.csv"
    write_csv(sample(trajectory, robot, placed.placement.transform, placed.component, source), file)
    tolerances = {"path_tolerance": 20e-6, "axis_tolerance": AXIS_TOLERANCE}
    asked = {"tilt": instance.tilt, "job_digest": "test", "constraints": FREE, "collision_world": NOTHING}
    of_a_part = ("gouge on cuts and links", "gouge on rapids", "surface left on the region")  # there is none
    verdict = verify(file, robot, instance.toolpath, **asked, **tolerances, waived=of_a_part)
    return verdict.passed


@pytest.mark.parametrize(
    "instance",
    [pytest.param(each, id=each.name, marks=() if each is FEW[0] else pytest.mark.slow) for each in FEW],
)
def test_planned_or_rightly_refused(instance, tmp_path):
    assert check(instance, 20_000, tmp_path)


@pytest.mark.slow
def test_nearly_all_of_many_are_planned_or_rightly_refused(tmp_path):
    failed = [instance.name for instance in MANY if not check(instance, 100_000, tmp_path)]
    assert len(failed) <= 0.03 * len(MANY), failed
