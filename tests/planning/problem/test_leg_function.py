"""The legs that smoothing sees are those of the machine, where they end beside the tool axis, too."""

import numpy as np
import pytest

from pentapod.kinematics.mode import Mode
from pentapod.machine import Machine
from pentapod.planning.limits.margins import Margins
from pentapod.planning.problem.formulation import leg_function
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples


@pytest.mark.parametrize("name", ["desk", "bench-general", "hexa", "spr", "prpu"])
def test_legs_are_those_of_the_robot(cap, name):
    machine = Machine.load(name)
    problem = PlacementProblem.of(ToolpathSamples.of(cap, np.radians(15.0)), machine)
    nominal, turn = np.array([0.1, -0.2, 1.0]), np.diag([1.0, -1.0, -1.0])
    nominal /= np.linalg.norm(nominal)
    axis, centre = turn @ nominal, machine.work.centre
    tip = centre - problem.samples.tilt_centre * axis
    p = tip + machine.tool_length * axis
    margins = Margins.of(machine, Mode(*machine.robot.branch(p, -axis).tolist()))
    across = np.linalg.svd(nominal[None])[2][1:].T
    legs = leg_function(problem, margins)(np.zeros(2), np.zeros(3), nominal, across, turn, centre)
    np.testing.assert_allclose(np.asarray(legs).ravel(), machine.robot.leg_lengths(p, -axis), atol=1e-12)
