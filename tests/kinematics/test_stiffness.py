"""Moments and stiffness, against equilibrium, elastic energy and finite loads on springs."""

import numpy as np
import pytest
from scipy.optimize import minimize

from pentapod.base.errors import ArrayError
from pentapod.geometry import normalised
from pentapod.kinematics import (
    LinearPentapod,
    leg_load_map,
    leg_moment_map,
    orientation_distance,
    position_distance,
    tip_compliance,
    tip_moment_amplification,
    tip_stiffness,
)

TOOL = 0.3
SPRINGS = np.array([2.0e6, 3.0e6, 2.5e6, 4.0e6, 1.5e6])


@pytest.fixture
def poses(pentapod: LinearPentapod, random_poses) -> tuple[np.ndarray, np.ndarray]:
    """200 poses well away from the singularities."""
    p, i = random_poses(pentapod, 3000, seed=17)
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    far = (orientation_distance(pentapod, p, i) > 0.2) & (position_distance(pentapod, p, i) > 0.2 * size)
    return p[far][:200], i[far][:200]


def test_leg_forces_hold_a_moment(pentapod: LinearPentapod, poses) -> None:
    p, i = poses
    maps = leg_moment_map(pentapod, p, i, TOOL)
    joints = p[:, None, :] + pentapod.offsets[:, None] * i[:, None, :]
    along = normalised(joints - np.c_[pentapod.base, np.zeros(5)])
    size = np.abs(maps).max(axis=(1, 2))[:, None]
    for moment in np.eye(3):
        each = (maps @ moment)[..., None] * along
        np.testing.assert_allclose(each.sum(axis=1) / size, 0.0, atol=1e-11)
        held = np.cross(joints - (p + TOOL * i)[:, None], each).sum(axis=1)
        across = moment - (i @ moment)[:, None] * i
        np.testing.assert_allclose(held / size, -across / size, atol=1e-11)


def test_a_couple_acts_alike_wherever(pentapod: LinearPentapod, poses) -> None:
    p, i = poses
    one, other = leg_moment_map(pentapod, p, i, 0.0), leg_moment_map(pentapod, p, i, 0.8)
    np.testing.assert_allclose(one, other, rtol=1e-7, atol=1e-9 * np.abs(one).max())


def test_moment_amplification_is_the_worst_of_all_directions(pentapod: LinearPentapod, poses) -> None:
    p, i = poses
    worst = tip_moment_amplification(pentapod, p, i, TOOL)
    loads = normalised(np.random.default_rng(0).normal(size=(4000, 3)))
    tried = np.linalg.norm(np.einsum("nij,kj->nki", leg_moment_map(pentapod, p, i, TOOL), loads), axis=-1).max(axis=1)
    assert (tried <= worst * (1 + 1e-12)).all()
    assert (tried >= worst * 0.99).all()


def test_stiffness_is_the_curvature_of_the_springs_energy(pentapod: LinearPentapod, poses) -> None:
    """Energy of the springs at displaced poses, by the leg lengths alone."""
    p, i = poses[0][:20], poses[1][:20]
    rest = pentapod.leg_lengths(p, i)
    rng = np.random.default_rng(3)
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    stiffness = tip_stiffness(pentapod, p, i, SPRINGS, TOOL)
    for step in (1e-4, -1e-4):
        twist = rng.normal(size=(20, 6)) * step * np.array([size] * 3 + [1.0] * 3)
        turned = rotated(i, twist[:, 3:])
        moved = p + TOOL * i + twist[:, :3] - TOOL * turned
        stretch = pentapod.leg_lengths(moved, turned) - rest
        energy = 0.5 * (SPRINGS * stretch**2).sum(axis=1)
        np.testing.assert_allclose(0.5 * np.einsum("nj,njk,nk->n", twist, stiffness, twist), energy, rtol=2e-2)
    np.testing.assert_allclose(stiffness, np.swapaxes(stiffness, 1, 2), rtol=1e-12, atol=1e-6)
    spin = np.concatenate([np.zeros((20, 3)), i], axis=1)
    np.testing.assert_allclose(np.einsum("njk,nk->nj", stiffness, spin), 0.0, atol=1e-9 * np.abs(stiffness).max())


def rotated(vectors: np.ndarray, by: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(by).apply(vectors)


def test_a_loaded_machine_settles_where_the_compliance_says(paper: LinearPentapod) -> None:
    """Minimise the potential energy of springs and load over poses: no Jacobian, no inverse."""
    p, i = np.array([0.5, 0.25, 3.0]), np.array([0.36, 0.48, 0.8])
    rest = paper.leg_lengths(p, i)
    t1, t2 = normalised(np.cross(i, [1.0, 0.0, 0.0])), normalised(np.cross(i, np.cross(i, [1.0, 0.0, 0.0])))
    springs = SPRINGS / 1e6
    force, moment = np.array([2e-5, -3e-5, 5e-5]), np.array([4e-5, 1e-5, -2e-5])

    def pose(x):
        turn = x[3] * t1 + x[4] * t2
        return p + TOOL * i + x[:3] - TOOL * rotated(i, turn), rotated(i, turn), turn

    def potential(x):
        q, j, turn = pose(x * 1e-4)
        return (
            0.5 * (springs * (paper.leg_lengths(q, j) - rest) ** 2).sum() - force @ x[:3] * 1e-4 - moment @ turn
        ) * 1e8

    found = minimize(potential, np.zeros(5), method="BFGS", options={"gtol": 1e-6}).x * 1e-4
    expected = tip_compliance(paper, p, i, springs, TOOL) @ np.concatenate([force, moment])
    np.testing.assert_allclose(found[:3], expected[:3], rtol=5e-3, atol=5e-3 * np.abs(expected[:3]).max())
    turn = found[3] * t1 + found[4] * t2
    np.testing.assert_allclose(turn, expected[3:], rtol=5e-3, atol=5e-3 * np.abs(expected[3:]).max())


def test_stiffness_and_compliance_undo_each_other(pentapod: LinearPentapod, poses) -> None:
    p, i = poses
    stiffness = tip_stiffness(pentapod, p, i, SPRINGS, TOOL)
    compliance = tip_compliance(pentapod, p, i, SPRINGS, TOOL)
    held = np.tile(np.eye(6), (len(p), 1, 1))
    held[:, 3:, 3:] -= i[:, :, None] * i[:, None, :]
    np.testing.assert_allclose(stiffness @ compliance, held, atol=1e-7)


def test_singular_and_missing_poses_and_bad_springs(paper: LinearPentapod) -> None:
    p = np.array([[0.5, 0.25, 3.0], [0.5, 0.25, 3.0], [np.nan, 0.0, 1.0]])
    i = np.array([[0.36, 0.48, 0.8], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    p[1] = (0.1, 0.2, 0.0)  # the line lies on the base, across the x axis: every leg in the base plane
    loads = leg_load_map(paper, p, i, TOOL)
    assert np.isfinite(loads[0]).all()
    assert np.isinf(loads[1]).all()
    assert np.isnan(loads[2]).all()
    assert tip_moment_amplification(paper, p, i, TOOL)[1] == np.inf
    assert np.isinf(tip_compliance(paper, p, i, SPRINGS, TOOL)[1]).all()
    assert np.linalg.matrix_rank(tip_stiffness(paper, p, i, SPRINGS, TOOL)[1]) < 5
    with pytest.raises(ArrayError, match="positive"):
        tip_stiffness(paper, p, i, [1.0, 1.0, 0.0, 1.0, 1.0], TOOL)
    with pytest.raises(ArrayError, match="shape"):
        tip_compliance(paper, p, i, [1.0, 1.0], TOOL)
