"""Distance from architectural singularity with independent platform: it is reached, and nothing tried is nearer."""

import numpy as np
import pytest
from scipy.optimize import minimize

from pentapod.kinematics import GeneralPentapod, LinearPentapod
from pentapod.kinematics.forward.line_equations import line_condition
from pentapod.theory import architectural_distance, design_distance

BASE = np.array([[0.58, -0.12], [0.22, 0.55], [-0.33, 0.5], [-0.6, -0.04], [-0.05, -0.59]])
OFFSETS = np.array([0.10, 0.03, -0.05, -0.12, 0.16])


def rows(design: np.ndarray) -> np.ndarray:
    x, y, z = design.T
    return np.stack([np.ones(5), x, y, z, x * z, y * z], axis=1)


@pytest.mark.parametrize("seed", range(3))
def test_the_design_found_is_singular_and_as_far_as_said(seed: int) -> None:
    rng = np.random.default_rng(seed)
    base, offsets = rng.uniform(-1.0, 1.0, (5, 2)), rng.uniform(-1.0, 1.0, 5)
    found = design_distance(base, offsets)
    move = np.column_stack([found.base - base, found.offsets - offsets])
    assert np.linalg.norm(move) == pytest.approx(found.distance, rel=1e-9)
    singular = np.linalg.svd(rows(np.column_stack([found.base, found.offsets])), compute_uv=False)
    assert singular[-1] <= 1e-9 * singular[0]
    assert line_condition(found.base, found.offsets) <= 1e-8
    np.testing.assert_allclose(found.weights @ rows(np.column_stack([found.base, found.offsets])), 0.0, atol=1e-8)


def test_a_penalty_search_that_knows_no_weights_finds_nothing_nearer() -> None:
    """It lowers the least singular value of the rows, from random starts; the search asked for knows the equations."""
    own = np.column_stack([BASE, OFFSETS])
    found = design_distance(BASE, OFFSETS)
    rng = np.random.default_rng(7)
    for _ in range(6):
        flat = own.ravel() + rng.normal(scale=0.1, size=15)
        for weight in (1e2, 1e4, 1e6):
            flat = minimize(
                lambda x, by=weight: (
                    np.square(x - own.ravel()).sum()
                    + by * np.linalg.svd(rows(x.reshape(5, 3)), compute_uv=False)[-1] ** 2
                ),
                flat,
                method="L-BFGS-B",
            ).x
        assert np.linalg.norm(flat - own.ravel()) >= 0.98 * found.distance


def test_it_is_no_farther_than_within_the_quadratic_family() -> None:
    delta = 0.185
    within = architectural_distance(BASE)
    move = within.nearest - BASE
    in_family = np.sqrt(np.square(move).sum() + delta**2 * np.square(move[:, 0]).sum())
    robot = LinearPentapod.quadratic(BASE, delta)
    assert design_distance(robot.base, robot.offsets).distance <= in_family * (1.0 + 1e-9)


def test_it_neither_depends_on_the_place_nor_on_the_unit() -> None:
    one = design_distance(BASE, OFFSETS)
    other = design_distance(1e3 * (BASE + np.array([0.4, -0.2])), 1e3 * (OFFSETS + 0.3))
    assert other.distance == pytest.approx(1e3 * one.distance, rel=1e-6)


def test_singular_designs_have_distance_0() -> None:
    base = BASE.copy()
    base[1] = base[0]
    offsets = OFFSETS.copy()
    offsets[1] = offsets[0]
    assert design_distance(base, offsets).distance == pytest.approx(0.0, abs=1e-9)
    level = np.where(np.arange(5) < 4, 0.1, 0.2)
    assert design_distance(BASE, level).distance == pytest.approx(0.0, abs=1e-9)


def test_two_legs_that_nearly_coincide_are_the_nearest_reason() -> None:
    base, offsets = BASE.copy(), OFFSETS.copy()
    base[1], offsets[1] = base[0] + [1e-3, 0.0], offsets[0]
    found = design_distance(base, offsets)
    assert GeneralPentapod(base, offsets).conditioning < 0.01
    assert found.distance <= 1e-3 / np.sqrt(2.0) * (1.0 + 1e-9)
