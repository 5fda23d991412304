"""Next to w = 0, u = 1/δ, where the legs of the quadratic family leave a circle of poses free."""

import mpmath as mp
import numpy as np
import pytest

from pentapod.kinematics import AssemblyObstacle, LinearPentapod, assembly_obstacles
from pentapod.kinematics.forward.quadratic import reciprocal_condition

BASE = 0.2 * np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)])
COMPONENTS = [(1, 1), (1, -1), (-1, 1), (-1, -1)]
ULP = 2.0**-52


def beside_it(n: int, delta: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Poses with |w| and |u − 1/δ| of 1e-2 to 1e-18, or 0."""
    rng = np.random.default_rng(seed)
    u, w = (10.0 ** rng.uniform(-18, -2, (2, n))) * rng.choice([-1, 0, 1], (2, n), p=[0.475, 0.05, 0.475])
    u = np.clip(1.0 / delta + u, -1.0, 1.0)
    v = np.sqrt(np.maximum(1.0 - u * u - w * w, 0.0)) * rng.choice([-1, 1], n)
    i = np.stack([u, v, w], axis=1)
    return rng.uniform((-0.5, -0.5, 0.1), (0.5, 0.5, 1.0), (n, 3)), i / np.linalg.norm(i, axis=1)[:, None]


def residual(robot: LinearPentapod, p: np.ndarray, i: np.ndarray, legs: np.ndarray) -> np.ndarray:
    """The largest error of a leg, in units in the last place of the longest length that enters."""
    longest = np.maximum(legs.max(axis=-1), max(np.abs(robot.base).max(), np.abs(robot.offsets).max()))
    return np.abs(robot.leg_lengths(p, i) - legs).max(axis=-1) / longest / ULP


@pytest.mark.parametrize("lever", [0.0, 0.05])
@pytest.mark.parametrize("delta", [1.0, -1.0, 1.0 + 1e-7, 1.25, -3.0, 10.0])
@pytest.mark.parametrize("count", [1500, pytest.param(100_000, marks=pytest.mark.slow)])
def test_poses_have_their_legs_or_are_named(delta: float, lever: float, count: int) -> None:
    robot = LinearPentapod(BASE, lever + delta * BASE[:, 0], delta)
    legs = robot.leg_lengths(*beside_it(count, delta))
    obstacles = assembly_obstacles(robot, legs)
    assert set(np.unique(obstacles.obstacle)) <= {AssemblyObstacle.NONE, AssemblyObstacle.SELF_MOTION}
    assert obstacles.exists.mean() > 0.8
    for component in COMPONENTS:
        p, i = robot.pose(legs, component)
        found = np.isfinite(p).all(axis=1)
        np.testing.assert_array_equal(found, obstacles.exists)
        assert residual(robot, p[found], i[found], legs[found]).max() <= 8.0
        assert (robot.branch(p[found], i[found]) == component).all()


@pytest.mark.slow
def test_poses_of_any_design_have_their_legs_or_are_named() -> None:
    rng, tried = np.random.default_rng(1), 0
    while tried < 40:
        delta, base = rng.choice([-1, 1]) * 10.0 ** rng.uniform(0, 1.5), rng.uniform(-1, 1, (5, 2))
        if reciprocal_condition(base, delta) < 1e-2:
            continue
        robot = LinearPentapod(base, rng.uniform(-0.2, 0.2) + delta * base[:, 0], delta)
        p, i = beside_it(4000, delta, tried)
        legs = robot.leg_lengths(p, i)
        near = (np.abs(i[:, 2]) < 1e-4) & (np.abs(1.0 - delta * i[:, 0]) < 1e-4)
        q, j = robot.pose(legs[near], (1, -1))
        found = np.isfinite(q).all(axis=1)
        np.testing.assert_array_equal(found, assembly_obstacles(robot, legs[near]).exists)
        assert residual(robot, q[found], j[found], legs[near][found]).max() <= 8.0
        tried += 1


def test_residuals_hold_in_fifty_digits() -> None:
    robot = LinearPentapod(BASE, 0.05 + 2.0 * BASE[:, 0], 2.0)
    legs = robot.leg_lengths(*beside_it(60, 2.0, seed=2))
    p, i = robot.pose(legs, (1, 1))
    found = np.isfinite(p).all(axis=1)
    assert found.sum() > 40
    with mp.workdps(50):
        for position, direction, lengths in zip(
            p[found].tolist(), i[found].tolist(), legs[found].tolist(), strict=True
        ):
            norm = mp.sqrt(sum(mp.mpf(c) ** 2 for c in direction))
            for (x, y), offset, length in zip(robot.base.tolist(), robot.offsets.tolist(), lengths, strict=True):
                joint = [mp.mpf(c) + mp.mpf(offset) * d / norm for c, d in zip(position, direction, strict=True)]
                exact = mp.sqrt((joint[0] - x) ** 2 + (joint[1] - y) ** 2 + joint[2] ** 2)
                assert abs(exact - mp.mpf(length)) <= 8.0 * ULP * max(lengths)


def test_on_the_self_motion_there_is_no_pose_and_that_is_said() -> None:
    delta = 1.25
    robot, i = LinearPentapod.quadratic(BASE, delta), np.array([0.8, 0.6, 0.0])
    angles = np.linspace(0.1, 3.0, 40)
    p = np.stack([0.7 * np.cos(angles), np.full(40, 0.2), 0.7 * np.sin(angles)], axis=1)
    legs = robot.leg_lengths(p, i)
    assert np.ptp(legs, axis=0).max() < 1e-15, "leg 3's joint turns about an axis parallel to y, and no leg notices"
    assert np.isnan(robot.pose(legs, (1, 1))[0]).all()
    obstacles = assembly_obstacles(robot, legs)
    assert (obstacles.obstacle == AssemblyObstacle.SELF_MOTION).all()
    assert np.isnan(obstacles.shortfall).all()
    assert "self-motion" in obstacles.explain(0)
