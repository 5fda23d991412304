"""A machine as built plays its own program in MuJoCo: rings that turn, scales with zeros, joints off the plane."""

from dataclasses import replace

import numpy as np
import pytest

from pentapod.geometry.directions import angle_between
from pentapod.kinematics import AsBuiltPentapod
from pentapod.simulate import Reference, plant, simulate_mujoco, simulate_servo
from short_motion import motion


@pytest.fixture(scope="module")
def built():
    """The same tool path in the legs of a machine with errors."""
    program, machine = motion(0.8, "cubic")
    rng = np.random.default_rng(0)
    real = AsBuiltPentapod.of(
        machine.robot,
        base_errors=rng.uniform(-2e-4, 2e-4, (5, 3)),
        zeros=rng.uniform(-5e-4, 5e-4, 5),
        radii=[0.0, 0.012, 0.0, 0.03, 0.02],
    )
    poses = machine.robot.pose(program.legs, program.component)
    own = replace(program, legs=real.leg_lengths(*poses))
    return Reference(own, replace(machine, robot=real)), Reference(program, machine)


def tip_error(physics, reference):
    return np.linalg.norm(physics.tips - reference.tips[::2], axis=1).max()


def test_mujoco_follows_the_program_of_a_machine_as_built(built):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    reference = built[0]
    physics = simulate_mujoco(reference, plant(reference)).unwrap()
    assert tip_error(physics.played, reference) <= 20e-6
    assert angle_between(physics.played.directions, reference.directions[::2]).max() <= 1e-4
    assert np.abs(physics.played.legs - reference.program.legs).max() <= 20e-6
    assert physics.closure.max() <= 20e-6


def test_the_nominal_program_on_the_true_machine_is_off_by_millimetres(built):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    own, nominal = built
    small = AsBuiltPentapod.of(
        nominal.machine.robot, base_errors=own.machine.robot.base - nominal.machine.robot.base_joints
    )
    true = AsBuiltPentapod.of(small, zeros=own.machine.robot.zeros)
    physics = simulate_mujoco(nominal, plant(nominal, true=true)).unwrap()
    assert 0.2e-3 < tip_error(physics.played, nominal) < 10e-3


def test_servo_loops_carry_a_machine_as_built(built):
    assert tip_error(simulate_servo(built[0]).unwrap(), built[0]) < 0.2e-3
