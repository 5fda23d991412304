"""The largest singularity-free sphere, against constrained optimisation over rigid motions and random displacements."""

import numpy as np
import pytest
from scipy.optimize import minimize

from pentapod.geometry import normalised
from pentapod.kinematics import LinearPentapod, singularity_values
from pentapod.theory import singularity_free_sphere


def joint_distance(pentapod: LinearPentapod, p, i, q, j) -> np.ndarray:
    here = p[..., None, :] + pentapod.offsets[:, None] * i[..., None, :]
    there = q[..., None, :] + pentapod.offsets[:, None] * j[..., None, :]
    return np.sqrt(((here - there) ** 2).sum(axis=-1).mean(axis=-1))


def test_the_sphere_touches_a_singular_pose(pentapod: LinearPentapod, random_poses, leg_determinant) -> None:
    p, i = random_poses(pentapod, 2000, seed=21)
    sphere = singularity_free_sphere(pentapod, p, i)
    np.testing.assert_allclose(np.linalg.norm(sphere.direction, axis=1), 1.0, rtol=1e-14)
    np.testing.assert_allclose(joint_distance(pentapod, p, i, sphere.position, sphere.direction), sphere.radius)
    w, s = singularity_values(pentapod, sphere.position, sphere.direction)
    assert np.abs(np.where(sphere.surface == 0, w, s)).max() < 1e-13
    tilted = sphere.surface == 1
    assert 0.1 < tilted.mean() < 0.9
    scale = np.abs(leg_determinant(pentapod, p, i))[tilted].max()
    touched = leg_determinant(pentapod, sphere.position[tilted], sphere.direction[tilted])
    assert np.abs(touched).max() < 1e-11 * scale


@pytest.mark.parametrize("count", [4, pytest.param(40, marks=pytest.mark.slow)])
def test_nothing_singular_is_nearer(pentapod: LinearPentapod, random_poses, leg_determinant, count: int) -> None:
    """SLSQP from many starts over positions and (free) directions, constrained to |i| = 1 and a zero determinant."""
    rng = np.random.default_rng(22)
    positions, directions = random_poses(pentapod, count, seed=23)
    positions[count // 2 :, 2] *= 0.1
    spheres = singularity_free_sphere(pentapod, positions, directions)
    size = np.abs(pentapod.base - pentapod.base[2]).max()
    for p, i, radius in zip(positions, directions, spheres.radius, strict=True):
        scale = np.abs(leg_determinant(pentapod, p + size * np.eye(3), i)).max()
        found = []
        for _ in range(6):
            start = np.concatenate([p + 0.5 * size * rng.normal(size=3), normalised(i + 0.5 * rng.normal(size=3))])
            answer = minimize(
                lambda x, p=p, i=i: (joint_distance(pentapod, p, i, x[:3], x[3:]) / size) ** 2,
                start,
                method="SLSQP",
                constraints=[
                    {"type": "eq", "fun": lambda x, d=scale: leg_determinant(pentapod, x[:3], x[3:]) / d},
                    {"type": "eq", "fun": lambda x: x[3:] @ x[3:] - 1.0},
                ],
                options={"ftol": 1e-14, "maxiter": 300},
            )
            if answer.success and abs(answer.x[3:] @ answer.x[3:] - 1.0) < 1e-8:
                found.append(size * np.sqrt(answer.fun))
        w = distance_to_the_equator(pentapod, i)
        assert min([*found, w]) == pytest.approx(radius, rel=1e-4)
        assert min(found) > radius * (1 - 1e-5)


def distance_to_the_equator(pentapod: LinearPentapod, i: np.ndarray) -> float:
    """To w = 0 by trying all horizontal directions."""
    turn = np.linspace(0.0, 2.0 * np.pi, 20001)
    flat = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=-1)
    # the platform's joints follow the centroid, which need not move
    return float(pentapod.offsets.std() * np.linalg.norm(flat - i, axis=1).min())


def test_displacements_within_the_sphere_keep_the_component(pentapod: LinearPentapod, random_poses) -> None:
    p, i = random_poses(pentapod, 400, seed=24)
    sphere = singularity_free_sphere(pentapod, p, i)
    component = pentapod.branch(p, i)
    rng = np.random.default_rng(25)
    size = sphere.radius[:, None] * rng.uniform(0.0, 2.0, size=(400, 500))
    j = normalised(i[:, None] + size[..., None] / pentapod.offsets.std() * rng.normal(size=(400, 500, 3)))
    q = p[:, None] + size[..., None] * rng.normal(size=(400, 500, 3))
    inside = joint_distance(pentapod, p[:, None], i[:, None], q, j) < sphere.radius[:, None]
    assert inside.sum() > 5000
    same = (pentapod.branch(q, j) == component[:, None]).all(axis=-1)
    assert same[inside].all()
    assert not same.all()


def test_near_a_singularity_the_radius_keeps_its_digits(pentapod: LinearPentapod, random_poses) -> None:
    """On the surface it is 0; a nanometre along the surface's normal, it is a nanometre."""
    p, i = random_poses(pentapod, 300, seed=26)
    far = singularity_free_sphere(pentapod, p, i)
    tilted = (far.surface == 1) & (np.abs(far.direction[:, 2]) > 0.05)
    q, j = far.position[tilted], far.direction[tilted]
    assert singularity_free_sphere(pentapod, q, j).radius.max() < 1e-14
    mean = pentapod.offsets.mean()
    back = p[tilted] - q + mean * (i[tilted] - j)  # of the joints' centroid
    # The straight way to the centre of the sphere, seen on the touching pose, is normal to the surface.
    back_line = i[tilted] - j
    back_line -= (back_line * j).sum(axis=1, keepdims=True) * j
    back -= mean * back_line
    for step in (1e-5, 1e-7, 1e-9):
        t = (step / far.radius[tilted])[:, None]
        at, along = q + t * back, normalised(j + t * back_line)
        near, moved = singularity_free_sphere(pentapod, at, along), joint_distance(pentapod, at, along, q, j)
        np.testing.assert_allclose(near.radius, moved, rtol=1e-2 * step**0.5, atol=3e-15)


def test_odd_poses(paper: LinearPentapod) -> None:
    upright = singularity_free_sphere(paper, [0.0, 0.0, 3.0], [0.0, 0.0, 1.0])
    assert upright.radius.shape == ()
    assert 0.0 < upright.radius <= paper.offsets.std() * np.sqrt(2.0)
    assert np.isnan(singularity_free_sphere(paper, [np.nan, 0.0, 3.0], [0.0, 0.0, 1.0]).radius)
    assert singularity_free_sphere(paper, [0.0, 0.3, 0.0], [0.36, 0.48, 0.8]).radius < 1e-15
    assert singularity_free_sphere(paper, [1.0, 0.3, 2.0], [0.6, 0.8, 0.0]).radius == 0.0
    along_x = singularity_free_sphere(LinearPentapod.quadratic(paper.base, 1.0), [1.0, 2.0, 3.0], [1.0, 0.0, 0.0])
    assert along_x.radius == 0.0
    batch = singularity_free_sphere(paper, np.ones((4, 1, 3)), np.tile([0.36, 0.48, 0.8], (2, 1)))
    assert batch.radius.shape == (4, 2)
    assert batch.position.shape == (4, 2, 3)
    assert not batch.radius.flags.writeable
