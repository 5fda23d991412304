"""Forces of the drives: terms along a path against MuJoCo's inverse dynamics, and rows of legs against the terms."""

import numpy as np
import pytest

from mujoco_forces import MACHINES, by_mujoco, curves, loaded
from pentapod.kinematics.forces import leg_force_map
from pentapod.machine.dynamics.dynamics import Dynamics


@pytest.mark.parametrize("count", [12, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", MACHINES)
def test_forces_along_a_path_are_those_of_mujoco(name: str, count: int) -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    machine = loaded(name)
    curve, x, u = curves(machine, count, 3)
    forces = Dynamics.of(machine).along(curve).forces(x, u)
    found = np.array([by_mujoco(mujoco, machine, [(t[k], a[k]) for t, a in curve], x[k], u[k]) for k in range(count)])
    assert np.abs(found).max() > 300.0
    np.testing.assert_allclose(forces, found, atol=1e-6, rtol=0.0)


@pytest.mark.parametrize("name", MACHINES)
def test_forces_of_rows_are_those_along_the_path(name: str) -> None:
    """The motion of the platform, from rates and accelerations of the legs alone."""
    machine = loaded(name)
    curve, x, u = curves(machine, 500, 4)
    dynamics = Dynamics.of(machine)
    terms = dynamics.along(curve)
    _, one, two = machine.robot.leg_derivatives(curve, machine.tool_length)
    (tip, axis), v = curve[0], np.sqrt(x)[:, None]
    position = tip + machine.tool_length * axis
    rows = dynamics.of_rows(position, -axis, one * v, one * u[:, None] + two * x[:, None])
    np.testing.assert_allclose(rows.quadratic + rows.weight, terms.forces(x, u), atol=1e-8)
    np.testing.assert_array_equal(rows.reach, terms.reach)


def test_reach_is_the_largest_force_for_a_newton_on_the_tip() -> None:
    machine = loaded("desk")
    curve, *_ = curves(machine, 50, 5)
    position = curve[0][0] + machine.tool_length * curve[0][1]
    loads = leg_force_map(machine.robot, position, -curve[0][1], machine.tool_length)
    np.testing.assert_allclose(Dynamics.of(machine).along(curve).reach, np.linalg.norm(loads, axis=-1), rtol=1e-9)
