"""HeightField: the topmost surface under points."""

from __future__ import annotations

import numpy as np
import trimesh

from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.heightfield import HeightField

UP = np.array([0.0, 0.0, 1.0])


def test_a_sphere_and_what_lies_beside_it():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=1.0)
    field = HeightField(Mesh.of(np.asarray(ball.vertices), np.asarray(ball.faces)), UP)
    points = np.c_[np.random.default_rng(0).uniform(-1.2, 1.2, (500, 2)), np.zeros(500)]
    surface, _, heights = field.topmost(points)
    inside = np.hypot(*points[:, :2].T) < 0.99
    expected = np.sqrt(1.0 - (points[inside, :2] ** 2).sum(axis=1))
    np.testing.assert_allclose(heights[inside], expected, atol=0.02)
    beside = np.hypot(*points[:, :2].T) > 1.0
    assert np.isneginf(heights[beside]).all()
    assert np.isnan(surface[beside]).all()
    # What is below does not count, however many facets are there; of two facets at one height the first does.
    vertices, faces = np.asarray(ball.vertices), np.asarray(ball.faces)
    stacked = np.concatenate([vertices, vertices, vertices - [0.0, 0.0, 3.0]])
    again = HeightField(Mesh.of(stacked, np.concatenate([faces + k * len(vertices) for k in range(3)])), UP)
    np.testing.assert_array_equal(again.topmost(points)[2], heights)
    np.testing.assert_array_equal(again.topmost(points)[0], surface)
    np.testing.assert_array_equal(again.hides(points - [0.0, 0.0, 2.0], 0.1), np.isfinite(heights))
    assert len(field.topmost(points[:0])[2]) == 0


def test_whether_the_surface_is_above_a_height_is_as_by_its_own_height():
    """On two noisy sheets, one over a part of the other: at heights about theirs, and beside them."""
    random = np.random.default_rng(1)
    flat = trimesh.creation.box((2.0, 2.0, 0.0)).subdivide().subdivide().subdivide().subdivide()
    vertices = np.asarray(flat.vertices) + random.normal(0.0, 0.02, (len(flat.vertices), 3))
    stacked = np.concatenate([vertices, 0.5 * vertices + [0.2, 0.1, 0.4]])
    field = HeightField(Mesh.of(stacked, np.concatenate([flat.faces, flat.faces + len(vertices)])), UP)
    points = random.uniform(-1.2, 1.2, (2000, 3))
    own = field.topmost(points)[2]
    for heights in (random.uniform(-0.1, 0.6, 2000), own - 1e-6, own + 1e-6, np.full(2000, -np.inf)):
        np.testing.assert_array_equal(field.above(points, np.where(np.isnan(heights), 0.0, heights)), own > heights)
    assert np.isfinite(own).mean() < 0.9
