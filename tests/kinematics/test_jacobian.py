"""Jacobians against finite differences; forces against equilibrium."""

import numpy as np
import pytest

from pentapod.geometry import normalised
from pentapod.kinematics import (
    LinearPentapod,
    leg_force_map,
    pose_jacobian,
    square_jacobian,
    tip_force_amplification,
)
from pentapod.kinematics.jacobian import line_tangents


@pytest.fixture
def poses(pentapod: LinearPentapod, random_poses) -> tuple[np.ndarray, np.ndarray]:
    """300 poses well away from the singularities."""
    p, i = random_poses(pentapod, 3000, seed=7)
    from pentapod.kinematics import orientation_distance, position_distance

    size = np.abs(pentapod.base - pentapod.base[2]).max()
    far = (orientation_distance(pentapod, p, i) > 0.2) & (position_distance(pentapod, p, i) > 0.2 * size)
    assert far.sum() > 300
    return p[far][:300], i[far][:300]


def test_jacobian_is_the_slope_of_the_leg_lengths(pentapod: LinearPentapod, poses) -> None:
    p, i = poses
    step = 1e-6
    columns = []
    for axis in np.eye(3):
        columns.append(pentapod.leg_lengths(p + step * axis, i) - pentapod.leg_lengths(p - step * axis, i))
    for axis in np.eye(3):
        columns.append(pentapod.leg_lengths(p, i + step * axis) - pentapod.leg_lengths(p, i - step * axis))
    slopes = np.stack(columns, axis=-1) / (2 * step)
    jacobian = pentapod.jacobian(p, i)
    assert jacobian.shape == (300, 5, 6)
    np.testing.assert_allclose(jacobian, slopes, atol=2e-8)


def test_pose_jacobian_is_the_slope_of_the_forward_kinematics(pentapod: LinearPentapod, poses) -> None:
    p, i = poses
    legs, component = pentapod.leg_lengths(p, i), pentapod.branch(p, i)
    jacobian = pose_jacobian(pentapod, p, i)
    step = 1e-6 * np.abs(pentapod.base - pentapod.base[2]).max()
    for leg in range(5):
        ahead = np.concatenate(pentapod.pose(legs + step * np.eye(5)[leg], component), axis=-1)
        behind = np.concatenate(pentapod.pose(legs - step * np.eye(5)[leg], component), axis=-1)
        slope = (ahead - behind) / (2 * step)
        scale = np.abs(jacobian).max(axis=(1, 2))
        assert (np.abs(jacobian[..., leg] - slope).max(axis=1) < 1e-5 * scale).mean() > 0.97
        assert (np.abs(jacobian[..., leg] - slope).max(axis=1) < 1e-2 * scale).all()


def test_the_jacobians_undo_each_other(pentapod: LinearPentapod, poses) -> None:
    p, i = poses
    np.testing.assert_allclose(
        pentapod.jacobian(p, i) @ pose_jacobian(pentapod, p, i),
        np.broadcast_to(np.eye(5), (300, 5, 5)),
        atol=1e-9,
    )
    np.testing.assert_allclose(np.einsum("nj,njk->nk", i, pose_jacobian(pentapod, p, i)[:, 3:]), 0.0, atol=1e-10)


def test_square_jacobian_vanishes_with_the_leg_determinant(
    pentapod: LinearPentapod, random_poses, leg_determinant
) -> None:
    p, i = random_poses(pentapod, 500, seed=8)
    lengths = pentapod.leg_lengths(p, i).prod(axis=-1)
    ours = np.abs(np.linalg.det(square_jacobian(pentapod, p, i))) * lengths
    oracle = np.abs(leg_determinant(pentapod, p, i))
    np.testing.assert_allclose(ours, oracle, rtol=1e-9, atol=1e-12 * oracle.max())


def test_leg_forces_hold_the_platform_in_equilibrium(pentapod: LinearPentapod, poses) -> None:
    p, i = poses
    tool = 0.3
    forces = leg_force_map(pentapod, p, i, tool)
    attachments = np.c_[pentapod.base, np.zeros(5)]
    joints = p[:, None, :] + pentapod.offsets[:, None] * i[:, None, :]
    along = normalised(joints - attachments)
    tip = p + tool * i
    for load in np.eye(3):
        each = (forces @ load)[..., None] * along
        np.testing.assert_allclose(each.sum(axis=1), np.broadcast_to(-load, (300, 3)), atol=1e-9)
        moment = np.cross(joints - tip[:, None, :], each).sum(axis=1)
        np.testing.assert_allclose(moment, 0.0, atol=1e-9)


def test_amplification_is_the_worst_of_all_directions(pentapod: LinearPentapod, poses) -> None:
    p, i = poses
    amplification = tip_force_amplification(pentapod, p, i, 0.2)
    loads = normalised(np.random.default_rng(0).normal(size=(4000, 3)))
    tried = np.linalg.norm(np.einsum("nij,kj->nki", leg_force_map(pentapod, p, i, 0.2), loads), axis=-1).max(axis=1)
    assert (tried <= amplification * (1 + 1e-12)).all()
    assert (tried >= amplification * 0.99).all()


def test_virtual_work_at_the_tip(pentapod: LinearPentapod, poses) -> None:
    p, i = poses
    motion = pose_jacobian(pentapod, p, i)
    tip_rates = motion[:, :3] + 0.3 * motion[:, 3:]  # (N, 3, 5): tip velocity for each leg's
    np.testing.assert_allclose(leg_force_map(pentapod, p, i, 0.3), -np.swapaxes(tip_rates, 1, 2), atol=1e-8)


def test_singular_and_missing_poses(paper: LinearPentapod) -> None:
    p = np.array([[0.5, 0.25, 3.0], [0.5, 0.25, 3.0], [np.nan, 0.0, 1.0], [1.0, 0.0, 3.0]])
    i = np.array([[0.36, 0.48, 0.8], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [np.nan, 0.0, 1.0]])
    amplification = tip_force_amplification(paper, p, i, 0.2)
    assert np.isfinite(amplification[0])
    assert amplification[1] > 1e12  # infinite, or as good as
    assert np.isnan(amplification[2:]).all()
    assert np.isnan(pose_jacobian(paper, p, i)[2:]).all()
    assert line_tangents(i).shape == (4, 3, 2)
    assert tip_force_amplification(paper, p[0], i[0], 0.2).shape == ()
