"""Marching tetrahedra, against trimesh's notion of a solid and known volumes."""

import numpy as np
import pytest
import trimesh

from pentapod.theory.level_set import enclosed_volume, zero_surface


def grid(n: int) -> tuple[np.ndarray, float]:
    line = np.linspace(-1.3, 1.3, n)
    return np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1), line[1] - line[0]


def test_zero_surface_volume_of_an_ellipsoid_converges_with_the_square_of_the_step() -> None:
    errors = []
    for n in (16, 31, 61):
        nodes, step = grid(n)
        values = 1.0 - np.linalg.norm(nodes * (1.0, 1.2, 0.9), axis=-1)
        vertices, triangles = zero_surface(values, nodes[0, 0, 0], step)
        solid = trimesh.Trimesh(vertices, triangles, process=False)
        assert solid.is_watertight
        assert solid.is_winding_consistent
        assert solid.euler_number == 2
        assert enclosed_volume(vertices, triangles) == pytest.approx(solid.volume, rel=1e-10)
        errors.append(abs(solid.volume - 4.0 / 3.0 * np.pi / 1.08))
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]


def test_zero_surface_of_noise_and_of_full_grids_is_closed() -> None:
    for values in (np.random.default_rng(0).normal(size=(9, 8, 7)), np.ones((3, 4, 5)), np.zeros((2, 2, 2))):
        vertices, triangles = zero_surface(values, [1.0, 2.0, 3.0], 0.1)
        solid = trimesh.Trimesh(vertices, triangles, process=False)
        assert solid.is_watertight
        assert solid.is_winding_consistent
        assert solid.volume > 0.0
    full = zero_surface(np.ones((3, 4, 5)), [0.0, 0.0, 0.0], 0.1)[0]
    assert (full.min(axis=0) > -0.05).all()
    assert (full.max(axis=0) < np.array([0.25, 0.35, 0.45])).all()


def test_zero_surface_of_negative_values_is_empty() -> None:
    vertices, triangles = zero_surface(-np.ones((4, 4, 4)), [0.0, 0.0, 0.0], 0.1)
    assert vertices.shape == (0, 3)
    assert triangles.shape == (0, 3)
    assert enclosed_volume(vertices, triangles) == 0.0
