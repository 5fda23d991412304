"""The machine of the general family in both simulations: drives follow, the correction by the pose is refused."""

import numpy as np
import pytest

from pentapod import Program, RigidTransform
from pentapod.base.errors import MachineError
from pentapod.machine import Machine
from pentapod.program import Provenance, quantised
from pentapod.simulate import Reference, plant, simulate_mujoco, simulate_servo

MACHINE = Machine.load("bench-general")


@pytest.fixture(scope="module")
def reference() -> Reference:
    """A leaning loop of 0.6 s in the work volume."""
    u = np.linspace(0.0, 1.0, 601)
    rise = u**4 * (35 - 84 * u + 70 * u**2 - 20 * u**3)
    turn = 2.0 * np.pi * rise
    tips = MACHINE.work.centre + np.c_[0.02 * np.sin(turn), 0.015 * (1.0 - np.cos(turn)), 0.01 * rise]
    i = np.c_[0.14 * np.sin(turn), 0.1 * rise, np.ones_like(u)]
    i /= np.linalg.norm(i, axis=1, keepdims=True)
    p = tips - MACHINE.tool_length * i
    branch = next(b for b in MACHINE.robot.branches if tuple(b) == tuple(MACHINE.robot.branch(p[0], i[0])))
    source = Provenance(MACHINE.name, MACHINE.digest, "", "1")
    legs = quantised(MACHINE.robot.leg_lengths(p, i))
    return Reference(Program(1e-3, legs, "cubic", branch, RigidTransform.identity(), source), MACHINE)


def test_the_reference_is_the_way_of_the_tool(reference: Reference) -> None:
    assert np.ptp(reference.tips, axis=0).max() > 0.03


def test_servo_drives_follow_the_program(reference: Reference) -> None:
    played = simulate_servo(reference).unwrap()
    assert np.linalg.norm(played.tips - reference.tips[::2], axis=1).max() < 2e-3
    with pytest.raises(MachineError, match="correction by the pose needs a machine of the quadratic family"):
        simulate_servo(reference, correct=True)


def test_mujoco_plays_it_within_20_um(reference: Reference) -> None:
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    physics = simulate_mujoco(reference, plant(reference)).unwrap()
    assert np.linalg.norm(physics.played.tips - reference.tips[::2], axis=1).max() <= 20e-6
