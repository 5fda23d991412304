"""Machines with base joints anywhere and rings: poses from home by an optimiser, singularities by the Jacobian."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from pentapod.base.errors import ArrayError, MachineError
from pentapod.kinematics import AsBuiltPentapod, RingedPentapod
from pentapod.kinematics.arithmetic import NUMPY

# LinuxCNC's sample of pentakins, tool of 198 mm: its base is a wall beside the tool.
BASE = 1e-3 * np.array([[-418, -500, 226], [418, -500, 226], [0, -500, 396], [418, -500, -424], [-418, -500, -424]])
SAMPLE = RingedPentapod(
    BASE, 1e-3 * np.array([111, 83.5, 57.5, -34.5, -60.5]), np.full(5, 0.0803), np.array([0.0, 0.0, -0.112])
)
UP = np.array([0.0, 0.0, 1.0])


def poses(count: int, seed: int, far: float = 0.05, lean: float = 0.15) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    i = UP + rng.normal(scale=lean, size=(count, 3))
    return SAMPLE.home + rng.uniform(-far, far, (count, 3)), i / np.linalg.norm(i, axis=1, keepdims=True)


def readings(robot, p, i):
    """The lengths of the legs by points of the rings, the nearest of many."""
    turn = np.linspace(0.0, 2.0 * np.pi, 20_001)
    x = np.cross(i, [1.0, 0.0, 0.0])
    x /= np.linalg.norm(x)
    circle = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * np.cross(i, x)
    points = p + robot.offsets[:, None, None] * i + robot.radii[:, None, None] * circle
    return np.linalg.norm(points - robot.base[:, None], axis=2).min(axis=1) + robot.zeros


def test_legs_lead_to_the_nearest_points_of_the_rings() -> None:
    for p, i in zip(*poses(5, 1), strict=True):
        np.testing.assert_allclose(SAMPLE.leg_lengths(p, i), readings(SAMPLE, p, i), atol=2e-9)


def test_poses_are_those_that_an_optimiser_finds_near_home() -> None:
    p, i = poses(12, 2, far=0.02, lean=0.05)
    legs = SAMPLE.leg_lengths(p, i)
    found = SAMPLE.pose(legs, (1, 1))
    for k, row in enumerate(legs):

        def missed(x, row=row):
            direction = np.append(x[3:], 1.0) / np.linalg.norm(np.append(x[3:], 1.0))
            return SAMPLE.leg_lengths(x[:3], direction) - row

        best = least_squares(missed, [*SAMPLE.home, 0.0, 0.0], xtol=1e-15, ftol=1e-15, gtol=1e-15).x
        np.testing.assert_allclose(found[0][k], best[:3], atol=1e-9)
        np.testing.assert_allclose(found[1][k][:2] / found[1][k][2], best[3:], atol=1e-9)


def test_rows_of_a_motion_and_rows_by_themselves_give_one_pose() -> None:
    s = np.linspace(0.0, 1.0, 400)[:, None]
    (p, q), (i, j) = poses(2, 3)
    p, i = p + s * (q - p), i + s * (j - i)
    i /= np.linalg.norm(i, axis=1, keepdims=True)
    legs = SAMPLE.leg_lengths(p, i)
    followed = SAMPLE.pose(legs, (1, 1))
    np.testing.assert_allclose(followed[0], p, atol=1e-12)
    alone = [SAMPLE.pose(row, (1, 1)) for row in legs[::80]]
    np.testing.assert_allclose([pose[0] for pose in alone], followed[0][::80], atol=1e-12)
    legs[7] = np.nan
    assert np.isnan(SAMPLE.pose(legs, (1, 1))[0]).any(axis=1).tolist() == [k == 7 for k in range(400)]


def test_other_branches_and_lengths_without_a_pose_give_none() -> None:
    p, i = poses(3, 4)
    legs = SAMPLE.leg_lengths(p, i)
    assert (SAMPLE.branch(p, i) == 1).all()
    for branch in ((1, -1), (-1, 1), (-1, -1)):
        assert np.isnan(SAMPLE.pose(legs, branch)[0]).all()
    assert np.isnan(SAMPLE.pose(legs * [1.0, 1.0, 0.3, 1.0, 1.0], (1, 1))[0]).all()
    mirrored = [1.0, -1.0, 1.0]  # in the wall: the same legs and signs, but no way leads there from home
    q = (p - BASE[0]) * mirrored + BASE[0]
    np.testing.assert_allclose(SAMPLE.leg_lengths(q, i * mirrored), legs, atol=1e-12)
    np.testing.assert_allclose(SAMPLE.pose(legs, (1, 1))[0], p, atol=1e-12)
    with pytest.raises(ArrayError, match="branch is out of range"):
        SAMPLE.pose(legs, (2, 1))


def test_margin_is_the_way_to_the_zero_of_the_determinant_to_first_order() -> None:
    p, i = poses(40, 5)

    def determinant(p):
        last = np.concatenate([np.zeros_like(i), i], axis=1)[:, None]
        return np.linalg.det(np.concatenate([SAMPLE.jacobian(p, i), last], axis=1))

    h = 1e-6
    slope = np.stack([(determinant(p + h * e) - determinant(p - h * e)) / (2.0 * h) for e in np.eye(3)], axis=1)
    way = determinant(p) / np.linalg.norm(slope, axis=1)
    w, distance = SAMPLE.singularity_margins(list(p.T), list(i.T), SAMPLE.branches[0], NUMPY)
    np.testing.assert_allclose(np.asarray(w), i[:, 2])
    np.testing.assert_allclose(np.asarray(distance), way, rtol=2e-3)


def test_machine_as_built_has_poses_beside_it() -> None:
    built = AsBuiltPentapod.of(SAMPLE, base_errors=2e-4, offset_errors=1e-4, radii=1e-4, zeros=3e-4)
    p, i = poses(20, 6)
    found = built.pose(built.leg_lengths(p, i), (1, 1))
    np.testing.assert_allclose(found[0], p, atol=1e-12)
    np.testing.assert_allclose(found[1], i, atol=1e-12)


def test_wrong_geometries_are_refused() -> None:
    with pytest.raises(MachineError, match="negative radius"):
        RingedPentapod(BASE, SAMPLE.offsets, -SAMPLE.radii, SAMPLE.home)
    with pytest.raises(MachineError, match="home has shape"):
        RingedPentapod(BASE, SAMPLE.offsets, SAMPLE.radii, np.zeros(2))
    with pytest.raises(MachineError, match="home is singular"):
        RingedPentapod(BASE, SAMPLE.offsets, SAMPLE.radii, [0.0, -0.5, 0.0])
    assert SAMPLE.conditioning > 0.1
