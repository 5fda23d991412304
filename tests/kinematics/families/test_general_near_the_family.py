"""Forward kinematics of general pentapods that are nearly in the quadratic family, next to w = 0: no pose is lost."""

import numpy as np
import pytest

from pentapod.kinematics import GeneralPentapod, assembly_obstacles

BASE = 0.2 * np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])
EPS = 2.0**-52


@pytest.mark.parametrize(
    "deviation", [0.0, 1e-9, 1e-4, *(pytest.param(d, marks=pytest.mark.slow) for d in (1e-14, 1e-12, 1e-6, 1e-2))]
)
@pytest.mark.parametrize("count", [300, pytest.param(14_300, marks=pytest.mark.slow)])
def test_every_pose_of_a_pose_s_legs_is_found(deviation: float, count: int) -> None:
    rng = np.random.default_rng(0)
    offsets = 0.5 * BASE[:, 0] + 0.2 * deviation * rng.uniform(-1.0, 1.0, 5)
    robot = GeneralPentapod(BASE, offsets)
    for exponent in range(-3, -13, -1):
        angle, w = rng.uniform(0.0, 2.0 * np.pi, count), 10.0**exponent * rng.choice([-1.0, 1.0], count)
        i = np.stack([np.cos(angle), np.sin(angle), w], axis=1)
        i /= np.linalg.norm(i, axis=1)[:, None]
        p = rng.uniform((-0.3, -0.3, 0.3), (0.3, 0.3, 1.0), (count, 3))
        legs = robot.leg_lengths(p, i)
        mode = robot.branch(p, i)
        found = robot.pose(legs, np.where(mode == 0, 1, mode))
        assert np.isfinite(found[0]).all()
        assert assembly_obstacles(robot, legs).exists.all()
        assert np.abs(robot.leg_lengths(*found) - legs).max() < 64.0 * EPS * legs.max()
        assert (robot.branch(*found)[:, 0] == np.where(mode == 0, 1, mode)[:, 0]).all()


@pytest.mark.slow
def test_obstacles_and_poses_agree_whatever_the_size_of_the_batch() -> None:
    rng = np.random.default_rng(1)
    robot = GeneralPentapod(BASE, 0.5 * BASE[:, 0] + 1e-9 * rng.uniform(-1.0, 1.0, 5))
    angle = rng.uniform(0.0, 2.0 * np.pi, 400)
    i = np.stack([np.cos(angle), np.sin(angle), np.zeros(400)], axis=1)
    legs = robot.leg_lengths(rng.uniform((-0.3, -0.3, 0.3), (0.3, 0.3, 1.0), (400, 3)), i)
    legs *= 1.0 + 10.0 ** rng.uniform(-16, -13, (400, 1)) * rng.normal(
        size=legs.shape
    )  # of poses, of none, and of neither to within rounding
    whole = assembly_obstacles(robot, legs).exists
    assert 20 < whole.sum() < 400
    np.testing.assert_array_equal(whole, np.isfinite(robot.pose(legs, (1, 1))[0]).all(axis=1))
    for k in range(0, 400, 16):
        assert assembly_obstacles(robot, legs[k]).exists == whole[k]
        assert np.isfinite(robot.pose(legs[k], (-1, 1))[0]).all() == whole[k]
