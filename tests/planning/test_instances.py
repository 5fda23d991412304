"""Many random tasks: planned with every limit kept, or refused with a cause that brute force does not refute."""

import numpy as np
import pytest
from planning_instances import Instance, instances, machine

from pentapod.kinematics.component import COMPONENTS
from pentapod.machine.machine import Machine
from pentapod.planning import PlacedPath, plan
from pentapod.planning.margins import Margins
from pentapod.planning.plan import NEEDED_MARGIN
from pentapod.planning.sampling import best_tilted_margins, first_guesses
from pentapod.planning.task import Task
from pentapod.refusal import Refusal

FEW, MANY = instances(6), instances(300)
CLEARLY_FEASIBLE = 0.05


def brute_force(instance: Instance, machine: Machine, samples: int) -> float:
    """Return the best smallest margin of random placements with each waypoint's tilt chosen by itself."""
    task = Task.of(instance.toolpath, instance.tilt)
    guesses = first_guesses(task, machine, COMPONENTS, seed=99, samples=samples)
    return max(best_tilted_margins(task, Margins.of(machine, g.component), g.transform)[0].min() for g in guesses)


def check(instance: Instance, samples: int) -> bool:
    """Return whether a task was planned as it should be; everything else than the planner's optimality is asserted."""
    robot = machine(instance.machine)
    answer = plan(instance.toolpath, robot, tilt=instance.tilt)
    if isinstance(answer, Refusal):
        assert answer.blames
        assert all(blame.waypoints and blame.shortfall > 0.0 for blame in answer.blames)
        return brute_force(instance, robot, samples) < CLEARLY_FEASIBLE
    assert isinstance(answer, PlacedPath)
    p, i = answer.tips + robot.tool_length * answer.axes, -answer.axes
    legs = robot.pentapod.leg_lengths(p, i)
    assert ((legs > robot.legs.min_length) & (legs < robot.legs.max_length)).all()
    np.testing.assert_array_equal(robot.pentapod.component(p, i), np.tile(answer.component, (len(p), 1)))
    nominal = answer.placement.transform.rotate(instance.toolpath.axes)
    assert (np.cross(answer.axes, nominal) ** 2).sum(axis=1).max() <= np.sin(instance.tilt) ** 2 + 1e-12
    return answer.smallest_margin >= 0.8 * NEEDED_MARGIN


@pytest.mark.parametrize("instance", FEW, ids=lambda i: i.name)
def test_planned_or_rightly_refused(instance):
    assert check(instance, samples=20_000)


@pytest.mark.slow
def test_nearly_all_of_many_are_planned_or_rightly_refused():
    failed = [instance.name for instance in MANY if not check(instance, samples=100_000)]
    assert len(failed) <= 0.03 * len(MANY), failed
