"""Where the legs end: joints on the tool axis or beside it, and the rim of the base, as they are drawn."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pentapod.kinematics import RingedPentapod
from pentapod.machine import Machine
from pentapod.machine.leg_ends import arms_beside, base_rim, leg_ends


@pytest.mark.parametrize("name", ["desk", "hexa", "spr", "prpu"])
def test_arms_lead_from_the_axis_to_the_joints_beside_it(name):
    machine = Machine.load(name)
    tip, axis = machine.work.centre, np.array([0.0, 0.6, -0.8])
    _, joints = leg_ends(machine, tip, axis)
    beside, heights = arms_beside(machine)
    arms = joints[beside] - tip - heights[:, None] * axis
    assert beside.tolist() == {"desk": [], "hexa": [5], "spr": [0, 1, 2, 3], "prpu": [0, 1, 2, 3, 4]}[name]
    np.testing.assert_allclose(arms @ axis, 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(arms, axis=1), machine.robot.arms[beside])


def test_base_is_drawn_in_the_plane_of_its_joints():
    desk = Machine.load("desk")
    wall = [[-418, -500, 226], [418, -500, 226], [0, -500, 396], [418, -500, -424], [-418, -500, -424]]  # LinuxCNC's
    offsets = 1e-3 * np.array([111, 83.5, 57.5, -34.5, -60.5])
    robot = RingedPentapod(1e-3 * np.array(wall), offsets, np.full(5, 0.0803), [0.0, 0.0, -0.112])
    for machine, normal in ((desk, [0.0, 0.0, 1.0]), (dataclasses.replace(desk, robot=robot), [0.0, 1.0, 0.0])):
        rim = base_rim(machine, 33)
        np.testing.assert_allclose((rim - machine.robot.base_joints.mean(axis=0)) @ normal, 0.0, atol=1e-12)
        assert np.linalg.norm(rim - rim.mean(axis=0), axis=1).min() > 0.5
