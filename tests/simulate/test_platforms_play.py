"""Robots whose legs end beside the tool axis, in MuJoCo: arms, and the hinge of a revolute leg, are in their places."""

import numpy as np
import pytest

from pentapod.base.errors import MachineError
from pentapod.geometry.directions import angle_between
from pentapod.machine import Machine
from pentapod.simulate import Reference, plant, simulate_mujoco
from short_motion import loop


@pytest.mark.parametrize("name", ["hexa", "spr"])
def test_plays_within_microns(name: str) -> None:
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    machine = Machine.load(name)
    reference = Reference(loop(machine, 0.6), machine)
    played = simulate_mujoco(reference, plant(reference)).unwrap().played
    assert np.linalg.norm(played.tips - reference.tips[::2], axis=1).max() < 10e-6
    assert angle_between(played.directions, reference.directions[::2]).max() < 1e-4


def test_errors_of_joints_are_for_linear_pentapods() -> None:
    machine = Machine.load("hexa")
    with pytest.raises(MachineError, match="needs a linear pentapod"):
        plant(Reference(loop(machine, 0.1), machine), base_errors=1e-4)
