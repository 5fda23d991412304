"""Diagnosis and mending: known faults are found, counted and, where asked for, mended."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import toolpath_surfaces as surfaces
from pentapod.base.errors import MeshError
from pentapod.mesh.diagnosis import fault_edges
from pentapod.toolpath import Mesh


def test_a_sound_ball_has_no_problems():
    diagnosis = Mesh.of(*surfaces.sphere()).diagnosis
    assert diagnosis.problems == ()
    assert diagnosis.repairs == ()
    assert (diagnosis.bodies, diagnosis.border_loops, diagnosis.watertight) == (1, 0, True)
    assert diagnosis.area == pytest.approx(4 * np.pi * 0.05**2, rel=5e-3)


def test_loose_triangles_are_welded():
    vertices, faces = surfaces.sphere()
    mesh = Mesh.of(vertices[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3))
    assert len(mesh.vertices) == len(vertices)
    assert mesh.diagnosis.watertight
    assert mesh.diagnosis.repairs == ()


def test_noise_about_zero_is_welded():
    vertices, faces = surfaces.sphere()
    loose = vertices[faces].reshape(-1, 3)
    loose += np.random.default_rng(1).normal(size=loose.shape) * 1e-17
    assert Mesh.of(loose, np.arange(len(loose)).reshape(-1, 3)).diagnosis.watertight


def shaken(vertices, faces, by):
    loose = vertices[faces].reshape(-1, 3)
    noise = np.random.default_rng(1).uniform(-by, by, loose.shape)
    return Mesh.of(loose + noise, np.arange(len(loose)).reshape(-1, 3)).diagnosis


@pytest.mark.parametrize("by", [1e-9, 1e-8, 1e-7])
def test_shaken_corners_are_merged_and_the_merge_is_listed(by):
    vertices, faces = surfaces.sphere()
    diagnosis = shaken(vertices, faces, by)
    assert (diagnosis.facets, diagnosis.vertices, diagnosis.bodies) == (len(faces), len(vertices), 1)
    assert diagnosis.watertight
    assert any("vertices on borders merged with others less than 1 µm away" in text for text in diagnosis.repairs)
    assert diagnosis.problems == ()


def test_facets_that_do_not_join_are_a_problem():
    vertices, faces = surfaces.sphere()
    diagnosis = shaken(vertices, faces, 1e-5)
    assert diagnosis.bodies > 0.9 * len(faces)
    assert "the facets do not join" in str(diagnosis)
    assert "do not join" not in str(Mesh.of(vertices, faces[:1]).diagnosis)


def test_a_border_of_short_edges_keeps_its_shape():
    """Each is shorter than the distance within which borders are merged; the border is not."""
    angle = np.linspace(0.0, 2.0 * np.pi, 2001)[:-1]
    rim = 2e-4 * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    k = np.arange(2000)
    fan = np.stack([np.full(2000, 2000), k, (k + 1) % 2000], axis=1)
    far = np.array([[0.1, 0, 0], [0.2, 0, 0], [0.1, 0.1, 0]])
    mesh = Mesh.of(np.concatenate([rim, [[0, 0, 0]], far]), np.concatenate([fan, [[2001, 2002, 2003]]]))
    near = np.linalg.norm(mesh.vertices, axis=1) < 1e-3
    assert np.ptp(mesh.vertices[near], axis=0)[:2] == pytest.approx(4e-4, rel=1e-3)
    assert mesh.diagnosis.area == pytest.approx(5e-3 + np.pi * 4e-8, rel=1e-4)


def test_duplicated_and_degenerate_facets_are_dropped_and_listed():
    vertices, faces = surfaces.sphere()
    bad = np.concatenate([faces, faces[:10], faces[10:15, ::-1], [[0, 0, 1], [2, 3, 3]]])
    mesh = Mesh.of(vertices, bad)
    assert (mesh.diagnosis.duplicated, mesh.diagnosis.degenerate) == (15, 2)
    assert mesh.diagnosis.repairs == ("2 degenerate facets dropped", "15 duplicated facets dropped")
    assert mesh.diagnosis.watertight
    assert mesh.diagnosis.consistent


def test_duplicates_of_all_facets_are_dropped():
    vertices, faces = surfaces.sphere()
    mesh = Mesh.of(vertices, np.concatenate([faces, faces]))
    assert mesh.diagnosis.watertight
    assert len(mesh.faces) == len(faces)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_winding_is_diagnosed_and_repaired_only_on_request(seed):
    vertices, faces = surfaces.sphere(subdivisions=2)
    random = np.random.default_rng(seed)
    wrong = random.random(len(faces)) < random.uniform(0.02, 0.98)
    wrong[random.integers(len(faces))] ^= True
    mixed = np.where(wrong[:, None], faces[:, ::-1], faces)
    found = Mesh.of(vertices, mixed).diagnosis
    assert found.consistent == (wrong.all() or not wrong.any())
    mended = Mesh.of(vertices, mixed, repair=True)
    assert mended.diagnosis.problems == ()
    assert mended.diagnosis.repairs
    centres = mended.vertices[mended.faces].mean(axis=1)
    assert ((mended.facet_normals * centres).sum(axis=1) > 0).all()


def test_inverted_mesh_is_diagnosed_and_repaired():
    vertices, faces = surfaces.sphere()
    found = Mesh.of(vertices, faces[:, ::-1])
    assert found.diagnosis.inverted
    assert "inside out" in str(found.diagnosis)
    assert not Mesh.of(vertices, faces[:, ::-1], repair=True).diagnosis.inverted


def test_a_moebius_strip_cannot_be_wound():
    n = 30
    angle = np.arange(n) * 2 * np.pi / n
    rim = [
        np.stack([(1 + s * np.cos(angle / 2)) * np.cos(angle), (1 + s * np.cos(angle / 2)) * np.sin(angle),
                  s * np.sin(angle / 2)], 1) for s in (-0.3, 0.3)
    ]  # fmt: skip
    a = np.arange(n - 1)
    faces = [np.stack([a, a + 1, n + a], 1), np.stack([a + 1, n + a + 1, n + a], 1)]
    faces.append(np.array([[n - 1, n, 2 * n - 1], [n, 0, 2 * n - 1]]))
    mesh = Mesh.of(np.concatenate(rim), np.concatenate(faces), repair=True)
    assert any("one-sided" in text for text in mesh.diagnosis.repairs)
    assert not mesh.diagnosis.consistent
    assert mesh.diagnosis.border_loops == 1


def test_open_plate_with_a_hole_has_two_borders():
    vertices, faces = surfaces.grid(lambda x, y: 0 * x)
    inside = np.hypot(*vertices[faces].mean(axis=1)[:, :2].T) < 0.02
    diagnosis = Mesh.of(vertices, faces[~inside]).diagnosis
    assert diagnosis.border_loops == 2
    assert not diagnosis.watertight


def test_a_third_sheet_on_an_edge_is_not_manifold():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]]) * 0.1
    diagnosis = Mesh.of(vertices, [[0, 1, 2], [1, 0, 3], [0, 1, 4]]).diagnosis
    assert diagnosis.non_manifold_edges == 1
    assert "more than two facets" in str(diagnosis)


def test_bodies_are_counted_and_extracted():
    vertices, faces = surfaces.sphere()
    both = Mesh.of(np.concatenate([vertices, vertices + 1.0]), np.concatenate([faces, faces + len(vertices)]))
    assert both.diagnosis.bodies == 2
    one = both.body(1)
    assert len(one.faces) == len(faces)
    with pytest.raises(MeshError, match="no such body"):
        both.body(2)


def test_bad_arrays_are_refused():
    vertices, faces = surfaces.sphere()
    with pytest.raises(MeshError, match="not there"):
        Mesh.of(vertices, faces + 1)
    with pytest.raises(MeshError, match="no facets"):
        Mesh.of(vertices, np.zeros((0, 3), int))
    with pytest.raises(MeshError, match="triangles"):
        Mesh.of(vertices, faces[:, :2])


def test_a_vertex_that_no_facet_uses_may_be_nan():
    vertices, faces = surfaces.sphere()
    mesh = Mesh.of(np.concatenate([vertices, [[np.nan] * 3]]), faces)
    assert len(mesh.vertices) == len(vertices)


def test_meshes_cannot_be_changed():
    mesh = Mesh.of(*surfaces.sphere())
    for array in (mesh.vertices, mesh.faces, mesh.facet_normals, mesh.corner_normals, mesh.vertex_normals):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_slivers_are_counted_and_kept():
    vertices, faces = surfaces.grid(lambda x, y: 0 * x, cells=4)
    needle = np.concatenate([vertices, [[0.2, 0, 0], [0.3, 0, 0], [0.25, 5e-5, 0]]])
    mesh = Mesh.of(needle, np.concatenate([faces, [[25, 26, 27]]]))
    assert mesh.diagnosis.slivers == 1
    assert len(mesh.faces) == 33
    assert "1 sliver" in str(mesh.diagnosis)
    np.testing.assert_allclose(np.sort(faults(mesh)["sliver"][0, :, 0]), [0.2, 0.3])


def faults(mesh):
    return fault_edges(mesh.vertices, mesh.topology)


def test_fault_edges_lie_at_the_faults():
    vertices, faces = surfaces.sphere(subdivisions=2)
    assert faults(Mesh.of(vertices, faces)) == {}
    turned = faces.copy()
    turned[7] = turned[7, ::-1]
    mesh = Mesh.of(vertices, np.delete(turned, 100, axis=0))
    found = faults(mesh)
    assert set(found) == {"border", "opposite winding"}
    corners = {tuple(p) for p in vertices[faces[7]]}
    assert {tuple(p) for p in found["opposite winding"].reshape(-1, 3)} == corners
    assert mesh.diagnosis.inconsistent_edges == 3
    assert {tuple(p) for p in found["border"].reshape(-1, 3)} == {tuple(p) for p in vertices[faces[100]]}
    third = Mesh.of(
        np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]]) * 0.1, [[0, 1, 2], [1, 0, 3], [0, 1, 4]]
    )
    assert faults(third)["more than two facets"].shape == (1, 2, 3)
