"""Leg lengths that no pose has: the inequality named is the one that fails, by the amount named."""

import numpy as np
import pytest

from pentapod.base.errors import ArrayError
from pentapod.kinematics import MODES, AssemblyObstacle, GeneralPentapod, LinearPentapod, assembly_obstacles


@pytest.fixture
def general() -> GeneralPentapod:
    rng = np.random.default_rng(0)
    return GeneralPentapod(rng.uniform(-1, 1, (5, 2)), rng.uniform(-1, 1, 5))


def sampled_line(robot, legs: np.ndarray) -> tuple[np.ndarray, ...]:
    """u² + v² − 1, (px² + py²)/l_3² − 1 and (|g| − |pz w|)/l_3 along the line of solutions (SVD), densely sampled."""
    (x, y), z = (robot.base - robot.base[2]).T, robot.offsets - robot.offsets[2]
    others = [0, 1, 3, 4]
    matrix = np.stack([z, -x, -y, -x * z, -y * z], axis=1)[others]
    right = 0.5 * (legs**2 - legs[2] ** 2 - x**2 - y**2 - z**2)[others]
    start, step = np.linalg.lstsq(matrix, right, rcond=None)[0], np.linalg.svd(matrix)[2][4]
    tau = np.concatenate([np.linspace(-30, 30, 60_001), np.linspace(-3, 3, 60_001)])
    t, px, py, u, v = (start + tau[:, None] * step).T
    direction, place = u * u + v * v - 1, (px * px + py * py) / legs[2] ** 2 - 1
    both = np.maximum(direction, place)
    angle = np.abs(t - px * u - py * v) / legs[2] - np.sqrt(np.maximum(-direction, 0) * np.maximum(-place, 0))
    return direction, place, both, np.where(both <= 0, angle, np.inf)


def test_the_inequality_named_fails_everywhere_by_what_is_said(general: GeneralPentapod) -> None:
    legs = np.random.default_rng(1).uniform(0.3, 2.5, (80, 5))
    obstacles = assembly_obstacles(general, legs)
    assert (np.bincount(obstacles.obstacle, minlength=6)[[0, 2, 3, 4, 5]] > 3).all()
    for length, obstacle, shortfall in zip(legs, obstacles.obstacle, obstacles.shortfall, strict=True):
        direction, place, both, angle = (values.min() for values in sampled_line(general, length))
        if obstacle == AssemblyObstacle.NONE:
            assert shortfall == 0.0
            assert angle < 1e-3
        elif obstacle == AssemblyObstacle.DIRECTION:
            assert direction == pytest.approx(shortfall, rel=1e-3, abs=1e-5)
        elif obstacle == AssemblyObstacle.POSITION:
            assert place == pytest.approx(shortfall, rel=1e-3, abs=1e-5)
        elif obstacle == AssemblyObstacle.APART:
            assert direction < 0.0
            assert place < 0.0
            assert 0.0 < both <= shortfall + 1e-9
        else:
            assert angle == pytest.approx(shortfall, rel=2e-2, abs=1e-3)


def test_a_pose_is_found_exactly_where_nothing_is_in_the_way(general: GeneralPentapod) -> None:
    legs = np.random.default_rng(2).uniform(0.3, 2.5, (20_000, 5))
    exists = assembly_obstacles(general, legs).exists
    for mode in MODES:
        np.testing.assert_array_equal(np.isfinite(general.pose(legs, mode)[0]).all(axis=-1), exists)


def test_it_serves_the_quadratic_family_too(pentapod: LinearPentapod, random_poses) -> None:
    p, i = random_poses(pentapod, 2000)
    legs = pentapod.leg_lengths(p, i) * np.random.default_rng(3).uniform(0.7, 1.3, (2000, 5))
    exists = assembly_obstacles(pentapod, legs).exists
    assert 20 < exists.sum() < 1980
    np.testing.assert_array_equal(exists, np.isfinite(pentapod.assembly_modes(legs)[0]).all(axis=(1, 2)))


def test_it_says_so_in_a_sentence(general: GeneralPentapod) -> None:
    good = general.leg_lengths([0.1, 0.05, 0.6], [0.36, 0.48, 0.8])
    obstacles = assembly_obstacles(general, [good, [np.nan, 1, 1, 1, 1], [1, 1, 9, 1, 1], [-1, 1, 1, 1, 1]])
    assert obstacles.explain(0) == "a pose exists"
    assert "0 ≤ l_i < ∞" in obstacles.explain(1)
    assert obstacles.explain(2).startswith("no assembly: violates u² + v² ≤ 1")
    assert "missed by" in obstacles.explain(2)
    assert obstacles.obstacle[3] == AssemblyObstacle.NOT_A_LENGTH
    assert assembly_obstacles(general, good).explain() == "a pose exists"
    with pytest.raises(ArrayError, match=r"legs has shape \(3,\)"):
        assembly_obstacles(general, [1.0, 2.0, 3.0])
