"""The polynomial (2) and its cofactors against determinants."""

import numpy as np
import pytest

from pentapod.kinematics import (
    GeneralPentapod,
    LinearPentapod,
    singularity_cofactors,
    singularity_polynomial,
    singularity_values,
)


@pytest.fixture
def general() -> GeneralPentapod:
    rng = np.random.default_rng(11)
    return GeneralPentapod(np.array([0.7, -0.4]) + rng.uniform(-1, 1, (5, 2)), rng.uniform(-1, 1, 5) + 0.3)


def poses(n: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(12)
    i = rng.normal(size=(n, 3))
    return rng.uniform(-2, 2, (n, 3)), i / np.linalg.norm(i, axis=1)[:, None]


def lower_rows(pentapod) -> np.ndarray:
    (x, y), z = pentapod.base.T, pentapod.offsets
    return np.stack([z, x, y, x * z, y * z, np.ones(5)], axis=1)


def test_cofactors_are_signed_minors_of_the_papers_matrix(general: GeneralPentapod) -> None:
    rows = lower_rows(general)
    minors = [(-1) ** k * np.linalg.det(np.delete(rows, k, axis=1)) for k in range(6)]
    np.testing.assert_allclose(singularity_cofactors(general), minors, rtol=1e-9, atol=1e-12)


def test_it_is_the_determinant_of_the_papers_matrix_in_any_frame(general: GeneralPentapod) -> None:
    p, i = poses(300)
    (px, py, pz), (u, v, w) = p.T, i.T
    top = np.stack(
        [w * pz, w * (pz * u - px * w), w * (pz * v - py * w), pz * (px * w - pz * u), pz * (py * w - pz * v), -w * w],
        axis=-1,
    )
    matrices = np.concatenate([top[:, None], np.broadcast_to(lower_rows(general), (300, 5, 6))], axis=1)
    np.testing.assert_allclose(singularity_polynomial(general, p, i), np.linalg.det(matrices), rtol=1e-8, atol=1e-10)


def test_it_is_the_determinant_of_the_legs(general: GeneralPentapod, pentapod: LinearPentapod, leg_determinant) -> None:
    p, i = poses(300)
    for robot in (general, pentapod):
        expected = leg_determinant(robot, p, i)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(singularity_polynomial(robot, p, i), expected, rtol=1e-7, atol=1e-9 * scale)


def test_in_the_quadratic_family_it_is_the_product_of_the_notes(paper: LinearPentapod, conic_determinant) -> None:
    x, y = paper.base.T
    others = [0, 1, 3, 4]
    f = np.linalg.det(np.stack([x * x, x * y, x, y], axis=1)[others])
    assert f == pytest.approx(264.0)
    np.testing.assert_allclose(singularity_cofactors(paper), [0.25 * 264, -0.125 * 264, 0, 0, 0, 0], atol=1e-12)
    p, i = poses(100)
    w, s = singularity_values(paper, p, i)
    np.testing.assert_allclose(singularity_polynomial(paper, p, i), 0.25 * w * 264.0 * s, rtol=1e-11, atol=1e-11)


def test_its_sign_orders_the_roots_and_is_the_modes_order(general: GeneralPentapod) -> None:
    p, i = poses(500)
    value = singularity_polynomial(general, p, i)
    np.testing.assert_array_equal(np.sign(value), general.branch(p, i)[:, 0])
    ratio = value / general.order_value(p, i)
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-6)
    # the two roots have opposite signs: a double root is a singularity
    positions, directions = general.assembly_modes(general.leg_lengths(p, i))
    assert (singularity_polynomial(general, positions, directions) * [-1, -1, 1, 1] > 0).all()
