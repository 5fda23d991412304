"""A limit that the package does not know: the force in the legs under a load at the tip, added by one class."""

from __future__ import annotations

import dataclasses
import pickle
from dataclasses import dataclass

import numpy as np
import pytest
from domes import dome

from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import Component
from pentapod.kinematics.forces import leg_force_map
from pentapod.planning import PlacedPath, PlacementConstraints, Weights, plan
from pentapod.planning.diagnosis import active_limits, diagnose
from pentapod.planning.limits.limit import LimitKind
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples

LOAD = np.array([30.0, -20.0, 40.0])
PLUS = Component(1, 1)


@dataclass(frozen=True)
class LegForce:
    """The largest leg force, newtons, that LOAD at the tip may call up."""

    largest: float
    name: str = "force in a leg"
    unit: str = "N"
    group: str = "strokes"

    def margin(self, pose):
        x, y, z = pose.direction
        columns, tool_length = [], pose.machine.tool_length
        for d, length, height in zip(pose.vectors, pose.lengths, pose.heights, strict=True):
            lever = height - tool_length
            across = [lever * (y * d[2] - z * d[1]), lever * (z * d[0] - x * d[2])]
            columns.append([component / length for component in (*d, *across)])
        forces = solved([list(row) for row in zip(*columns, strict=True)], [*LOAD, 0.0, 0.0])
        square = 0.0
        for force in forces:
            square = pose.xp.most(square, force * force)
        return 1.0 - square / self.largest**2

    def shortfall(self, margin):
        return self.largest * (np.sqrt(1.0 - margin) - 1.0)


def solved(matrix, right):
    """Gauss's elimination, element by element."""
    n = len(right)
    for k in range(n):
        for row in range(k + 1, n):
            share = matrix[row][k] / matrix[k][k]
            matrix[row] = [b - share * a for a, b in zip(matrix[k], matrix[row], strict=True)]
            right[row] = right[row] - share * right[k]
    found = [0.0] * n
    for k in reversed(range(n)):
        found[k] = (right[k] - sum(matrix[k][j] * found[j] for j in range(k + 1, n))) / matrix[k][k]
    return found


def with_force(largest):
    return (LimitKind(lambda _: [LegForce(largest)]),)


@pytest.fixture(scope="module")
def options(desk):
    here = RigidTransform(np.diag([1.0, -1.0, -1.0]), desk.work.centre)
    near = PlacementConstraints.free(
        low=here.translation - 0.05, high=here.translation + 0.05, reference=here, largest_turn=0.2
    )
    return {"constraints": near, "component": PLUS}


def forces(machine, tips, axes):
    """The largest leg force (N,) at each waypoint, by the kinematics' own map."""
    position = tips + machine.tool_length * axes
    return np.abs(leg_force_map(machine.robot, position, -axes, machine.tool_length) @ LOAD).max(axis=1)


def test_an_added_limit_holds_in_a_plan(desk, options):
    path = dome(0.06, 20.0, 40)
    without = plan(path, desk, **options)
    assert isinstance(without, PlacedPath), str(without)
    largest = 0.9 * forces(desk, without.tips, without.axes).max()
    placed = plan(path, desk, **options, limits=with_force(largest))
    assert isinstance(placed, PlacedPath), str(placed)
    found = forces(desk, placed.tips, placed.axes)
    assert found.max() < largest
    column = placed.margin_names.index("force in a leg")
    np.testing.assert_allclose(placed.margins[:, column], 1.0 - (found / largest) ** 2, atol=1e-9)
    told = next(each for each in active_limits(placed) if each.limit == "force in a leg")
    assert told.unit == "N"
    assert told.room == pytest.approx(largest - found.max())
    assert pickle.loads(pickle.dumps(placed)).margin_names == placed.margin_names


def test_an_added_limit_is_named_in_the_diagnosis(desk, cap):
    problem = PlacementProblem.of(ToolpathSamples.of(cap, 0.0), desk, component=PLUS, limits=with_force(1.0))
    margins, here = problem.margins[0], RigidTransform(np.diag([1.0, -1.0, -1.0]), desk.work.centre)
    values = problem.values(margins, here, problem.upright)
    named = {shortfall.constraint: shortfall for shortfall in diagnose(values, margins, 0.0)}
    tips, axes = problem.samples.machine_poses(here, cap.axes)
    needed = forces(desk, tips, axes).max() - 1.0
    assert named["force in a leg"].unit == "N"
    assert named["force in a leg"].shortfall == pytest.approx(needed)


def test_an_added_limit_has_the_weight_of_its_group(desk, cap):
    problem = PlacementProblem.of(
        ToolpathSamples.of(cap, 0.0), desk, weights=Weights(strokes=3.0), component=PLUS, limits=with_force(100.0)
    )
    assert problem.weights.of(problem.margins[0].limits)[-1] == 3.0
    even = dataclasses.replace(problem, weights=Weights())
    here = RigidTransform(np.diag([1.0, -1.0, -1.0]), desk.work.centre)
    plain, weighed = (each.values(each.margins[0], here, each.upright)[:, -1] for each in (even, problem))
    np.testing.assert_allclose(weighed - 0.02, (plain - 0.02) / 3.0)
