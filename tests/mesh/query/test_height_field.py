"""HeightField: the topmost surface under points, whatever the number of pairs that are looked at together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import trimesh

from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query import heightfield
from pentapod.mesh.query.heightfield import HeightField

UP = np.array([0.0, 0.0, 1.0])


def test_a_sphere_and_what_lies_beside_it(monkeypatch):
    ball = trimesh.creation.icosphere(subdivisions=4, radius=1.0)
    field = HeightField(Mesh.of(np.asarray(ball.vertices), np.asarray(ball.faces)), UP)
    points = np.c_[np.random.default_rng(0).uniform(-1.2, 1.2, (500, 2)), np.zeros(500)]
    surface, normals, heights = field.topmost(points)
    inside = np.hypot(*points[:, :2].T) < 0.99
    expected = np.sqrt(1.0 - (points[inside, :2] ** 2).sum(axis=1))
    np.testing.assert_allclose(heights[inside], expected, atol=0.02)
    beside = np.hypot(*points[:, :2].T) > 1.0
    assert np.isneginf(heights[beside]).all()
    assert np.isnan(surface[beside]).all()
    monkeypatch.setattr(heightfield, "OPTIONS", replace(heightfield.OPTIONS, most_pairs=7))
    for again, once in zip(field.topmost(points), (surface, normals, heights), strict=True):
        np.testing.assert_array_equal(again, once)
    assert len(field.topmost(points[:0])[2]) == 0
