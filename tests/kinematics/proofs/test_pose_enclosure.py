"""How far a platform strays while its legs keep within lengths: against the forward kinematics."""

import mpmath as mp
import numpy as np
import pytest

from pentapod.kinematics import LinearPentapod, pose_enclosure


def well_posed(pentapod, random_poses, leg_determinant):
    """Poses away from the singularities."""
    p, i = random_poses(pentapod, 2000, seed=1)
    return p[far := np.abs(leg_determinant(pentapod, p, i)) > np.median(np.abs(leg_determinant(pentapod, p, i)))], i[
        far
    ]


@pytest.mark.parametrize("half", [1e-6, 1e-4, 1e-3])
def test_no_lengths_in_the_hull_lead_further(pentapod, random_poses, leg_determinant, half):
    p, i = well_posed(pentapod, random_poses, leg_determinant)
    legs, component = pentapod.leg_lengths(p, i), pentapod.branch(p, i)
    size, rng = float(np.abs(pentapod.base).max()), np.random.default_rng(2)
    corners = legs[:, None] + half * size * rng.uniform(-1.0, 1.0, (len(p), 12, 5))
    corners[:, 0] = legs
    offsets = np.array([-0.3, 0.0, 0.7]) * size
    points, turn = pose_enclosure(pentapod, p, i, corners, offsets)
    proven = np.isfinite(turn)
    assert proven.mean() > {1e-6: 0.99, 1e-4: 0.9, 1e-3: 0.3}[half]
    reached = np.zeros(points.shape)
    for k in range(40):
        shares = np.eye(12)[k] if k < 12 else rng.dirichlet(np.full(12, 0.3))
        q, j = pentapod.pose(np.einsum("m,nmj->nj", shares, corners), component)
        way = np.linalg.norm((q - p)[:, None] + offsets[:, None] * (j - i)[:, None], axis=2)
        reached = np.fmax(reached, way)
        assert (way[proven] <= points[proven] * (1.0 + 1e-9) + 1e-12 * size).all()
        assert (np.linalg.norm(j - i, axis=1)[proven] <= turn[proven] * (1.0 + 1e-9) + 1e-12).all()
    assert np.median(points[proven] / reached[proven]) < (1.001 if half < 1e-5 else 2.0)


def test_lengths_that_change_too_much_prove_nothing(pentapod, random_poses):
    p, i = random_poses(pentapod, 20, seed=3)
    legs = pentapod.leg_lengths(p, i)
    points, turn = pose_enclosure(pentapod, p, i, np.stack([0.3 * legs, 2.0 * legs], axis=1), np.zeros(1))
    assert np.isinf(points).all()
    assert np.isinf(turn).all()


def test_no_pose_is_no_proof(pentapod):
    nowhere = np.full((1, 3), np.nan)
    points, turn = pose_enclosure(pentapod, nowhere, nowhere, np.ones((1, 2, 5)), np.zeros(2))
    assert np.isinf(points).all()
    assert np.isinf(turn).all()


@pytest.mark.parametrize("far", [0.0, 1e3, 1e6])
def test_rounding_is_counted_however_far_off_the_base_is(far):
    """Newton's method in 50 digits says where the platform is with these lengths."""
    near, shift = 0.2 * np.array([(-2.0, 1.0), (-1.0, -2.0), (0.0, 0.0), (1.0, -2.0), (2.0, 2.0)]), (far, -0.3 * far)
    robot = LinearPentapod.from_offsets(near + shift, 0.5 * near[:, 0], tolerance=1e-6)
    rng, arms = np.random.default_rng(4), np.array([-0.3, 0.0, 0.2])
    p = rng.uniform((-0.3, -0.3, 0.4), (0.3, 0.3, 0.9), (24, 3)) + np.array([*shift, 0.0])
    i = np.c_[rng.uniform(-0.6, 0.6, (24, 2)), np.ones(24)]
    i /= np.linalg.norm(i, axis=1)[:, None]
    legs = np.linalg.norm(robot.leg_vectors(p, i), axis=2)
    points, turn = pose_enclosure(robot, p, i, np.stack([legs, legs * (1.0 + 1e-15)], axis=1), arms)
    assert np.isfinite(turn).all()
    assert points.max() < 1e-12 + 5e-14 * far, "and not much more is counted"
    base = [[*row, 0.0] for row in robot.base.tolist()]
    with mp.workdps(50):
        for k in range(24):
            start = mp.matrix([*p[k].tolist(), *i[k].tolist()])
            x = start.copy()
            for _ in range(6):
                values, rows = [], []
                for a, z, length in zip(base, robot.offsets.tolist(), legs[k].tolist(), strict=True):
                    d = [x[c] + mp.mpf(z) * x[3 + c] - mp.mpf(a[c]) for c in range(3)]
                    values.append((sum(c * c for c in d) - mp.mpf(length) ** 2) / 2)
                    rows.append(d + [mp.mpf(z) * c for c in d])
                values.append((sum(x[3 + c] ** 2 for c in range(3)) - 1) / 2)
                rows.append([0, 0, 0, x[3], x[4], x[5]])
                x -= mp.lu_solve(mp.matrix(rows), mp.matrix(values))
            way = x - start
            for arm, point in zip(arms.tolist(), points[k].tolist(), strict=True):
                assert mp.sqrt(sum((way[c] + mp.mpf(arm) * way[3 + c]) ** 2 for c in range(3))) <= point
            assert mp.sqrt(sum(way[3 + c] ** 2 for c in range(3))) <= turn[k]
