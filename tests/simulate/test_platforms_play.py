"""Robots whose legs end beside the tool axis, in MuJoCo: arms, and the hinge of a revolute leg, are in their places."""

import numpy as np
import pytest

from pentapod.base.errors import MachineError
from pentapod.geometry.directions import angle_between
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import Component
from pentapod.machine import Machine
from pentapod.program import Program, Provenance, quantised
from pentapod.simulate import Reference, plant, simulate_mujoco


def loop(machine: Machine, seconds: float) -> Program:
    """A leaning loop in the work volume, from rest to rest."""
    u = np.linspace(0.0, 1.0, round(1e3 * seconds) + 1)
    rise = u**4 * (35 - 84 * u + 70 * u**2 - 20 * u**3)
    turn, lean = 2.0 * np.pi * rise, np.radians(12.0)
    tips = machine.work.centre + 0.01 * np.stack([np.sin(turn), 1.0 - np.cos(turn), rise], axis=1)
    i = np.stack([np.sin(lean) * np.sin(turn), np.sin(0.6 * lean) * rise, np.ones_like(rise)], axis=1)
    i /= np.linalg.norm(i, axis=1, keepdims=True)
    p = tips - machine.tool_length * i
    component = Component(*machine.robot.branch(p, i)[0].tolist())
    legs = quantised(machine.robot.leg_lengths(p, i))
    source = Provenance(machine.name, machine.digest, "job", "0", None)
    return Program(1e-3, legs, "cubic", component, RigidTransform(np.eye(3), np.zeros(3)), source)


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
