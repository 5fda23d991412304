"""Clearances between bodies, against points sampled on their axes."""

import numpy as np
import pytest

from pentapod.machine import Machine, clearances, pair_names, sample_work_volume


@pytest.fixture(scope="module")
def desk():
    return Machine.load("desk")


def by_points(machine, p, i, count=1500):
    """Brute force: all pairs of points on two axes."""
    bodies, robot = machine.bodies, machine.robot
    s = np.linspace(0.0, 1.0, count)[:, None]
    feet = [np.array([x, y, 0.0]) for x, y in robot.base]
    heads = [p + z * i for z in robot.offsets]
    reach = [np.linalg.norm(head - foot) for foot, head in zip(feet, heads, strict=True)]
    shaft = (p + robot.offsets.min() * i) * (1 - s) + (p + (machine.tool_length - bodies.shaft_end) * i) * s
    result = []

    def nearest(a, b):
        squared = (a * a).sum(1)[:, None] + (b * b).sum(1)[None] - 2 * a @ b.T
        return np.sqrt(max(squared.min(), 0.0))

    for j in range(5):
        for k in range(j + 1, 5):
            a, b = feet[j] * (1 - s) + heads[j] * s, feet[k] * (1 - s) + heads[k] * s
            result.append(nearest(a, b) - 2 * bodies.leg_radius)
    for k in range(5):
        stop = 1 - bodies.joint_radius / reach[k]
        a = feet[k] * (1 - stop * s) + heads[k] * stop * s
        result.append(nearest(a, shaft) - bodies.leg_radius - bodies.shaft_radius)
    return np.array(result)


def test_equals_brute_force(desk):
    tips, axes = sample_work_volume(desk.work, rings=1, around=5, levels=2)
    chosen = np.random.default_rng(3).choice(len(tips), 12, replace=False)
    tips, axes = tips[chosen], axes[chosen]
    found = clearances(desk, tips + desk.tool_length * axes, -axes)
    expected = [by_points(desk, t + desk.tool_length * a, -a) for t, a in zip(tips, axes, strict=True)]
    np.testing.assert_allclose(found, expected, atol=2e-5)
    assert (found <= np.array(expected) + 1e-9).all()  # points can only overestimate


def test_finds_crossing_legs(desk):
    # Turned upside down the platform joints come in the other order, so legs must cross on the way.
    rng = np.random.default_rng(0)
    turn = np.linspace(0.0, np.pi, 400)
    azimuth = rng.uniform(0, 2 * np.pi)
    across, down = np.array([np.cos(azimuth), np.sin(azimuth), 0.0]), np.array([0.0, 0.0, 1.0])
    i = np.cos(turn)[:, None] * down + np.sin(turn)[:, None] * across
    gaps = clearances(desk, desk.work.centre - 0.1 * i, i)
    assert gaps.min() < 0.0
    assert gaps.min() >= -(2 * desk.bodies.leg_radius + desk.bodies.leg_radius + desk.bodies.shaft_radius)


def test_names_match_columns(desk):
    names = pair_names(desk)
    assert len(names) == len(set(names)) == clearances(desk, desk.work.centre, [0.0, 0.0, 1.0]).shape[-1] == 15
    assert names[0] == "legs 1-2"
    assert names[9] == "legs 4-5"
    assert names[10] == "leg 1-shaft"


def test_absent_poses_stay_absent(desk):
    p = np.stack([desk.work.centre, np.full(3, np.nan)])
    found = clearances(desk, p, [0.0, 0.0, 1.0])
    assert np.isfinite(found[0]).all()
    assert np.isnan(found[1]).all()
