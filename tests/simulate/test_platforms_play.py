"""Robots whose legs end beside the tool axis, in MuJoCo: arms, and the hinge of a revolute leg, are in their places."""

import numpy as np
import pytest

from pentapod.base.errors import MachineError
from pentapod.geometry.directions import angle_between
from pentapod.machine import Machine
from pentapod.simulate import Reference, plant, simulate_mujoco
from pentapod.simulate.forces import leg_loads
from short_motion import loop


@pytest.mark.parametrize("name", ["hexa", "spr", "prpu"])
def test_plays_within_microns(name: str) -> None:
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    machine = Machine.load(name)
    reference = Reference(loop(machine, 0.6), machine)
    played = simulate_mujoco(reference, plant(reference)).unwrap().played
    assert np.linalg.norm(played.tips - reference.tips[::2], axis=1).max() < 10e-6
    assert angle_between(played.directions, reference.directions[::2]).max() < 1e-4


def test_loads_equal_the_power_of_the_bodies() -> None:
    """Of `prpu`: energies of rigid bodies by the compiled model's masses, the strut's among them; no virtual work."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    machine = Machine.load("prpu")
    reference = Reference(loop(machine, 0.8), machine)
    model, h = mujoco.MjModel.from_xml_string(plant(reference).xml), reference.program.period
    i = reference.directions[::2]
    p = reference.tips[::2] - machine.tool_length * i
    base, joints = machine.bars.ends(p, i)
    total = energies(model, "platform", p, i, machine, h)
    for k, (low, high) in enumerate([(f"leg{leg}", f"rod{leg}") for leg in range(1, 6)] + [("limb", "strut")]):
        along = joints[:, k] - base[:, k]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        for name, points in ((low, base[:, k]), (high, joints[:, k])):
            total = total + energies(model, name, points, along, machine, h)
    legs = reference.program.legs
    given = (leg_loads(reference)[1:-1] * (legs[2:] - legs[:-2]) / (2.0 * h)).sum(axis=1)
    np.testing.assert_allclose(given, np.diff(total) / h, atol=1e-2 * np.abs(given).max())


def energies(model, name, points, axes, machine, h):
    """Energies (N - 1,) of a slender body with its origin at points (N, 3), its z axis along axes (N, 3)."""
    body = model.body(name)
    centre = points + body.ipos[2] * axes
    v, w = (np.diff(x, axis=0) / h for x in (centre, axes))
    moving = 0.5 * body.mass * (v * v).sum(axis=1) + 0.5 * body.inertia[0] * (w * w).sum(axis=1)
    return moving - body.mass * (0.5 * (centre[1:] + centre[:-1]) @ machine.masses.gravity)


def test_errors_of_joints_are_for_linear_pentapods() -> None:
    machine = Machine.load("hexa")
    with pytest.raises(MachineError, match="needs a linear pentapod"):
        plant(Reference(loop(machine, 0.1), machine), base_errors=1e-4)
