"""Normals: smooth where the surface is, sharp at creases, right against analytic surfaces."""

from __future__ import annotations

import numpy as np
import pytest

import toolpath_surfaces as surfaces
from pentapod.geometry import angle_between
from pentapod.toolpath import Mesh


def test_corner_normals_of_a_ball_point_from_its_centre():
    mesh = Mesh.of(*surfaces.sphere())
    corners = mesh.vertices[mesh.faces]
    assert np.degrees(angle_between(mesh.corner_normals, corners)).max() < 0.2
    assert np.degrees(angle_between(mesh.facet_normals, corners[:, 0])).max() > 1.5  # facets are worse


def test_vertex_normals_of_a_torus_match_the_formula():
    mesh = Mesh.of(*surfaces.torus())
    x, y, z = mesh.vertices.T
    ring = np.hypot(x, y)
    exact = np.stack([x / ring * (ring - 0.04), y / ring * (ring - 0.04), z], 1)
    assert np.degrees(angle_between(mesh.vertex_normals, exact)).max() < 0.1
    np.testing.assert_allclose(mesh.corner_normals, mesh.vertex_normals[mesh.faces], atol=1e-12)


def test_corner_normals_of_a_box_keep_its_edges():
    mesh = Mesh.of(*surfaces.box())
    np.testing.assert_allclose(mesh.corner_normals, np.repeat(mesh.facet_normals[:, None], 3, axis=1), atol=1e-12)
    # Weighted by angle, a corner's three faces count alike although their triangles do not.
    np.testing.assert_allclose(np.abs(mesh.vertex_normals), 1 / np.sqrt(3), atol=1e-12)


@pytest.mark.parametrize(("fold_deg", "smooth"), [(30.0, True), (39.0, True), (41.0, False), (80.0, False)])
def test_corner_normals_are_smooth_up_to_the_crease_angle(fold_deg, smooth):
    slope = np.tan(np.radians(fold_deg / 2))
    mesh = Mesh.of(*surfaces.grid(lambda x, y: -slope * np.abs(x), cells=10))
    on_ridge = np.abs(mesh.vertices[mesh.faces][:, :, 0]) < 1e-9
    tilt = angle_between(mesh.corner_normals[on_ridge], [0, 0, 1])
    np.testing.assert_allclose(np.degrees(tilt), 0.0 if smooth else fold_deg / 2, atol=1.0 if smooth else 1e-6)


def test_normals_rotate_with_the_mesh_and_ignore_its_scale():
    from scipy.spatial.transform import Rotation

    vertices, faces = surfaces.grid(lambda x, y: 0.01 * np.sin(60 * x) * np.cos(40 * y))
    turn = Rotation.from_euler("xyz", [0.3, -0.7, 1.1]).as_matrix()
    plain, moved = Mesh.of(vertices, faces), Mesh.of(17.0 * vertices @ turn.T, faces)
    order = np.lexsort(plain.vertices[plain.faces].mean(axis=1).T.round(12))
    back = (moved.vertices @ turn / 17.0)[moved.faces].mean(axis=1)
    order_moved = np.lexsort(back.T.round(12))
    np.testing.assert_allclose(moved.facet_normals[order_moved] @ turn, plain.facet_normals[order], atol=1e-9)
    total = lambda mesh: np.sort(mesh.corner_normals[:, :, 2].ravel())  # noqa: E731
    np.testing.assert_allclose(np.sort((moved.corner_normals @ turn)[:, :, 2].ravel()), total(plain), atol=1e-9)
