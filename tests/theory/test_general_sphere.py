"""Singularity-free spheres of general pentapods: between two bounds, and the closed form in the quadratic family."""

import numpy as np
import pytest

from pentapod.kinematics import GeneralPentapod, LinearPentapod, singularity_polynomial
from pentapod.theory import bounded_singularity_free_sphere, singularity_free_sphere

BASE = np.array([[0.58, -0.12], [0.22, 0.55], [-0.33, 0.5], [-0.6, -0.04], [-0.05, -0.59]])
OFFSETS = np.array([0.10, 0.03, -0.05, -0.12, 0.16])
UP = np.array([0.0, 0.0, 1.0])
GENERAL = GeneralPentapod(BASE, OFFSETS)


def poses(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    i = rng.normal(size=(count, 3)) + UP
    return rng.uniform(-0.4, 0.4, (count, 3)) + 0.4 * UP, i / np.linalg.norm(i, axis=1, keepdims=True)


def joints(p: np.ndarray, i: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    return p[..., None, :] + offsets[:, None] * i[..., None, :]


def test_the_pose_found_is_singular_and_as_far_as_said() -> None:
    p, i = poses(12, 1)
    sphere = bounded_singularity_free_sphere(GENERAL, p, i)
    assert np.isfinite(sphere.found).all()
    np.testing.assert_allclose(np.linalg.norm(sphere.direction, axis=1), 1.0, atol=1e-12)
    here = np.abs(singularity_polynomial(GENERAL, p, i))
    there = np.abs(singularity_polynomial(GENERAL, sphere.position, sphere.direction))
    assert (there <= 1e-9 * np.maximum(here, here.max())).all()
    moved = joints(sphere.position, sphere.direction, OFFSETS) - joints(p, i, OFFSETS)
    np.testing.assert_allclose(np.sqrt(np.square(moved).sum(axis=(1, 2)) / 5.0), sphere.found, rtol=1e-9)


def test_the_proven_radius_is_not_larger_and_not_useless() -> None:
    p, i = poses(12, 2)
    sphere = bounded_singularity_free_sphere(GENERAL, p, i)
    assert (sphere.proven <= sphere.found).all()
    assert np.median(sphere.proven / sphere.found) > 0.15


def test_random_displacements_within_the_radius_found_keep_the_sign() -> None:
    p, i = poses(4, 3)
    sphere, rng = bounded_singularity_free_sphere(GENERAL, p, i), np.random.default_rng(4)
    spread, mean = OFFSETS.std(), OFFSETS.mean()
    for k in range(len(p)):
        step = rng.normal(size=(20_000, 6))
        step *= sphere.found[k] / np.linalg.norm(step, axis=1, keepdims=True)
        line = i[k] + step[:, 3:] / spread
        line /= np.linalg.norm(line, axis=1, keepdims=True)
        centre = p[k] + mean * i[k] + step[:, :3]
        far = np.sqrt(np.square(step[:, :3]).sum(axis=1) + spread**2 * np.square(line - i[k]).sum(axis=1))
        inside = far < 0.999 * sphere.found[k]
        values = singularity_polynomial(GENERAL, centre - mean * line, line)[inside]
        assert inside.sum() > 100
        assert (np.sign(values) == np.sign(singularity_polynomial(GENERAL, p[k], i[k]))).all()


@pytest.mark.parametrize("delta", [0.185, 0.8])
def test_in_the_quadratic_family_it_is_the_closed_form(delta: float) -> None:
    robot = LinearPentapod.quadratic(BASE, delta)
    p, i = poses(10, 5)
    exact = singularity_free_sphere(robot, p, i).radius
    sphere = bounded_singularity_free_sphere(GeneralPentapod(robot.base, robot.offsets), p, i)
    np.testing.assert_allclose(sphere.found, exact, rtol=1e-6)
    assert (sphere.proven <= exact * (1.0 + 1e-12)).all()


def test_a_pose_that_is_nan_has_no_sphere() -> None:
    sphere = bounded_singularity_free_sphere(GENERAL, [np.nan, 0.0, 0.4], [0.0, 0.0, 1.0])
    assert np.isnan(sphere.proven)
    assert np.isinf(sphere.found)
