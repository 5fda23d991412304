"""How far a platform strays while its legs keep within lengths: against the forward kinematics."""

import numpy as np
import pytest

from pentapod.kinematics import roaming


def well_posed(pentapod, random_poses, leg_determinant):
    """Poses away from the singularities."""
    p, i = random_poses(pentapod, 2000, seed=1)
    return p[far := np.abs(leg_determinant(pentapod, p, i)) > np.median(np.abs(leg_determinant(pentapod, p, i)))], i[
        far
    ]


@pytest.mark.parametrize("half", [1e-6, 1e-4, 1e-3])
def test_no_lengths_in_the_hull_lead_further(pentapod, random_poses, leg_determinant, half):
    p, i = well_posed(pentapod, random_poses, leg_determinant)
    legs, component = pentapod.leg_lengths(p, i), pentapod.component(p, i)
    size, rng = float(np.abs(pentapod.base).max()), np.random.default_rng(2)
    corners = legs[:, None] + half * size * rng.uniform(-1.0, 1.0, (len(p), 12, 5))
    corners[:, 0] = legs
    offsets = np.array([-0.3, 0.0, 0.7]) * size
    points, turn = roaming(pentapod, p, i, corners, offsets)
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
    points, turn = roaming(pentapod, p, i, np.stack([0.3 * legs, 2.0 * legs], axis=1), np.zeros(1))
    assert np.isinf(points).all()
    assert np.isinf(turn).all()


def test_no_pose_is_no_proof(pentapod):
    nowhere = np.full((1, 3), np.nan)
    points, turn = roaming(pentapod, nowhere, nowhere, np.ones((1, 2, 5)), np.zeros(2))
    assert np.isinf(points).all()
    assert np.isinf(turn).all()
