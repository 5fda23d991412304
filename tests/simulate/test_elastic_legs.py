"""Deflection of the tip against MuJoCo with legs that are springs: it knows nothing of our statics."""

import re
from dataclasses import replace

import numpy as np
import pytest

from pentapod.kinematics.families.as_built import AsBuiltPentapod
from pentapod.kinematics.forces import leg_force_map
from pentapod.machine import Machine, Stiffness, mjcf
from pentapod.machine.dynamics.deflection import Yielding, leg_pushes

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")

SPRING = 20e6


def tip_at_rest(machine, p, i, force):
    """The tip, metres, after two seconds with springs in the legs, under gravity and a force on the tip."""
    xml = mjcf(machine, AsBuiltPentapod.of(machine.robot), p, i, period=1e-3)
    xml = re.sub(r'kp="[^"]*" kv="[^"]*"', f'kp="{SPRING}" kv="{0.01 * SPRING}"', xml)
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.qpos[:] = model.qpos0
    mujoco.mj_forward(model, data)
    body, tip = model.body("platform").id, model.site("tip").id
    for _ in range(round(2.0 / model.opt.timestep)):
        data.xfrc_applied[body] = np.r_[force, np.cross(data.site_xpos[tip] - data.xipos[body], force)]
        mujoco.mj_step(model, data)
    mujoco.mj_kinematics(model, data)
    return data.site_xpos[tip].copy()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_tip_deflects_by_weight_and_force_as_in_mujoco(seed):
    rng, machine = np.random.default_rng(seed), Machine.load("desk")
    machine = replace(machine, stiffness=Stiffness(leg_stiffness=np.full(5, SPRING)))
    lean = 0.25 * rng.uniform(-1.0, 1.0, 2)
    i = np.array([*lean, np.sqrt(1.0 - lean @ lean)])
    p = machine.work.centre + 0.02 * rng.uniform(-1.0, 1.0, 3) - machine.tool_length * i
    force = 100.0 * (way := rng.normal(size=3)) / np.linalg.norm(way)
    weightless = replace(machine, masses=replace(machine.masses, gravity=np.zeros(3)))
    free, still, one = tip_at_rest(weightless, p, i, np.zeros(3)), np.zeros((1, 5)), (p[None], i[None])
    weight = leg_pushes(machine, *one, still, still)
    # A force on the tip is held by legs that push against it.
    held = leg_force_map(machine.robot, *one, machine.tool_length) @ force
    for moved, push in (
        (tip_at_rest(machine, p, i, np.zeros(3)), weight),
        (tip_at_rest(weightless, p, i, force), held),
    ):
        expected, found = moved - free, Yielding.of(machine, *one, push).shift[0]
        assert np.linalg.norm(expected) > 3e-6
        assert np.linalg.norm(found - expected) <= 0.01 * np.linalg.norm(expected)
