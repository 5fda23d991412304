"""Offset surfaces against closed forms, and what of them must hold for any mesh."""

from collections import Counter

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from pentapod import Mesh
from pentapod.base.errors import MeshError
from pentapod.mesh.offset.offset_surface import offset_surface
from pentapod.mesh.query.tree import FacetTree
from pentapod.theory.level_set import enclosed_volume

R = 3e-3


def offset(part, distance=R, step=0.25 * R, parts=1):
    return offset_surface(FacetTree.of(part), distance, step, parts)


def facets_at_edges(triangles):
    edges = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    return Counter(np.unique(edges, axis=0, return_counts=True)[1].tolist())


def box(low, high):
    made = trimesh.creation.box(bounds=[low, high])
    return made.vertices, made.faces


def joined(*parts):
    first = np.cumsum([0] + [len(v) for v, _ in parts])
    faces = [f + a for (_, f), a in zip(parts, first, strict=False)]
    return Mesh.of(np.concatenate([v for v, _ in parts]), np.concatenate(faces))


def distance_from_box(points, low, high):
    """Signed distance by the formula of an axis-aligned box."""
    over = np.maximum(np.asarray(low) - points, points - np.asarray(high))
    return np.linalg.norm(np.maximum(over, 0.0), axis=1) + np.minimum(over.max(axis=1), 0.0)


def test_offset_of_a_box_is_its_rounded_box():
    size = np.array([0.04, 0.03, 0.02])
    vertices, triangles = offset(Mesh.of(*box(-0.5 * size, 0.5 * size)))
    np.testing.assert_allclose(distance_from_box(vertices, -0.5 * size, 0.5 * size), R, atol=1e-12)
    a, b, c = size
    steiner = a * b * c + 2.0 * R * (a * b + b * c + c * a) + np.pi * R**2 * (a + b + c) + 4.0 / 3.0 * np.pi * R**3
    assert enclosed_volume(vertices, triangles) == pytest.approx(steiner, rel=1e-3)
    assert facets_at_edges(triangles) == {2: len(triangles) * 3 // 2}


def test_offset_surface_is_sharp_where_two_walls_meet_inside():
    """An L of two blocks: the centre of a ball in the corner is R from both walls."""
    low, high = (0.0, 0.0, 0.0), (0.04, 0.02, 0.005)
    wall_low, wall_high = (0.0, 0.0, 0.0), (0.005, 0.02, 0.03)
    vertices, _ = offset(joined(box(low, high), box(wall_low, wall_high)))
    corner = np.array([0.005 + R, 0.005 + R])
    inner = vertices[(np.abs(vertices[:, 1] - 0.01) < 0.008)]
    away = np.linalg.norm(inner[:, [0, 2]] - corner, axis=1)
    assert (away < 1e-6).sum() >= int(0.016 / (0.25 * R))
    clear = np.minimum(distance_from_box(vertices, low, high), distance_from_box(vertices, wall_low, wall_high))
    np.testing.assert_allclose(clear, R, atol=1e-9)


@pytest.mark.parametrize("shift", [0.0, 2.5e-4])
def test_a_slot_with_little_play_is_found_between_the_nodes(shift):
    """Two blocks on a plate, a slot with 0.4 mm of play between them; the step is 0.75 mm."""
    left, right = 0.02 + shift, 0.02 + shift + 2.0 * R + 4e-4
    part = joined(
        box((0.0, 0.0, 0.0), (0.04, 0.01, 0.005)),
        box((0.0, 0.0, 0.0), (left, 0.01, 0.01)),
        box((right, 0.0, 0.0), (0.04, 0.01, 0.01)),
    )
    found = []
    for parts in (1, 8):
        vertices, triangles = offset(part, parts=parts)
        foot = np.abs(vertices[:, 2] - 0.005 - R) < 1e-6
        inside = np.abs(vertices[:, 0] - 0.5 * (left + right)) <= 2e-4 + 1e-6
        found.append(int((foot & inside).sum()))
        assert all(number % 2 == 0 for number in facets_at_edges(triangles))
    assert found[0] == 0
    assert found[1] > 20
    ends = vertices[foot & inside][:, 1]
    assert ends.min() < 2e-4
    assert ends.max() > 0.01 - 2e-4
    apart = trimesh.proximity.closest_point(trimesh.Trimesh(part.vertices, part.faces, process=False), vertices)[1]
    np.testing.assert_allclose(apart, R, atol=1e-6)


def test_the_grid_stays_as_it_is_where_no_channel_is_narrow():
    for shape in (trimesh.creation.torus(0.012, 0.004), trimesh.creation.box([0.01] * 3)):
        part = Mesh.of(shape.vertices, shape.faces)
        np.testing.assert_array_equal(offset(part)[0], offset(part, parts=8)[0])


def test_offset_surface_ignores_what_the_ball_cannot_reach():
    """Neither the mirrored sheet within a part nor that of a cavity is there."""
    outer, inner = box([-0.02] * 3, [0.02] * 3), box([-0.012] * 3, [0.012] * 3)
    vertices, _ = offset(joined(outer, (inner[0], inner[1][:, ::-1])))
    assert (distance_from_box(vertices, [-0.02] * 3, [0.02] * 3) > 0.0).all()


def test_offset_surface_closes_a_hole_that_is_too_narrow_and_enters_a_wide_one():
    def plate(hole):
        far = 0.02
        slabs = [([-far, -far], [far, -hole]), ([-far, hole], [far, far]), ([-far, -hole], [-hole, hole]),
                 ([hole, -hole], [far, hole])]  # fmt: skip
        return joined(*(box([*low, 0.0], [*high, 0.01]) for low, high in slabs))

    for hole, enters in ((0.9 * R, False), (1.3 * R, True)):
        vertices, _ = offset(plate(hole))
        inside = (np.abs(vertices[:, :2]) < hole).all(axis=1)
        assert (np.abs(vertices[inside, 2] - 0.005).min() < 1e-3) == enters


def test_open_sheet_has_an_offset_on_both_sides():
    vertices, triangles = offset(
        Mesh.of([(0, 0, 0), (0.03, 0, 0), (0.03, 0.02, 0), (0, 0.02, 0)], [(0, 1, 2), (0, 2, 3)])
    )
    volume = 0.03 * 0.02 * 2.0 * R + np.pi * R**2 * 0.05 + 4.0 / 3.0 * np.pi * R**3
    assert enclosed_volume(vertices, triangles) == pytest.approx(volume, rel=4e-3)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**31), count=st.integers(1, 12))
def test_offset_of_any_soup_is_closed_and_at_its_distance(seed, count):
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-0.015, 0.015, size=(count, 1, 3)) + rng.uniform(-0.008, 0.008, size=(count, 3, 3))
    part = Mesh.of(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    vertices, triangles = offset(part, parts=4)
    assert all(number % 2 == 0 for number in facets_at_edges(triangles))
    apart = trimesh.proximity.closest_point(trimesh.Trimesh(part.vertices, part.faces, process=False), vertices)[1]
    assert np.abs(apart - R).max() < 0.05 * R
    assert np.quantile(np.abs(apart - R), 0.95) < 1e-7
    assert enclosed_volume(vertices, triangles) > 4.0 / 3.0 * np.pi * R**3


@pytest.mark.parametrize("low", [0.0, R, -R])
def test_faces_in_line_with_the_grid_do_no_harm(low):
    vertices, triangles = offset(Mesh.of(*box([low] * 3, [low + 8 * R] * 3)), step=R / 4)
    assert np.isfinite(vertices).all()
    assert facets_at_edges(triangles) == {2: len(triangles) * 3 // 2}


def test_a_part_too_large_for_the_ball_is_refused():
    with pytest.raises(MeshError, match="too fine for this part"):
        offset(Mesh.of(*box([0.0] * 3, [3.0] * 3)), 1e-4, 2.5e-5)
