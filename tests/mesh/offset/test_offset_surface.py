"""Offset surfaces against closed forms, and what of them must hold for any mesh."""

from collections import Counter

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from left_material import facet_distances
from lengths import examples
from pentapod import Mesh
from pentapod.base.errors import MeshError
from pentapod.mesh.offset.offset_surface import Window, offset_surface, onto_level
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


def channel(end, opening, turn):
    """A channel up from a plate that opens along y: a ball's centre has room `end` wide at y = 0, then more."""
    blocks = [
        trimesh.creation.box(bounds=[[-0.02, -0.03, 0.0], [0.02, -R, 0.012]]),
        trimesh.creation.box(bounds=[[-0.03, -0.03, -0.005], [0.03, 0.03, 0.003]]),
    ]
    for side in (1.0, -1.0):
        wall = trimesh.creation.box(bounds=[[min(0.0, 0.02 * side), -0.03, 0.0], [max(0.0, 0.02 * side), 0.03, 0.012]])
        wall.apply_transform(trimesh.transformations.rotation_matrix(-0.5 * side * opening, [0.0, 0.0, 1.0]))
        wall.apply_translation([side * (0.5 * end + R / np.cos(0.5 * opening)), 0.0, 0.0])
        blocks.append(wall)
    whole = trimesh.util.concatenate(blocks)
    whole.apply_transform(trimesh.transformations.rotation_matrix(turn, [0.0, 0.0, 1.0]))
    return Mesh.of(whole.vertices, whole.faces)


@pytest.mark.parametrize("end", [3e-4, 5e-4])
@pytest.mark.parametrize("turn_deg", [20.0, 45.0])
def test_no_facet_leads_across_a_channel_about_as_wide_as_a_cell(end, turn_deg):
    """Some edges of the grid, whose step is 0.75 mm, meet the channel, and some do not."""
    part = channel(end, np.radians(5.0), np.radians(turn_deg))
    vertices, triangles = offset(part, parts=8)
    beyond = FacetTree.of(part).closest(vertices[triangles].mean(axis=1), 2.0 * R)[0] / R - 1.0
    assert beyond.max() < 0.05
    without, its = offset(part)
    assert FacetTree.of(part).closest(without[its].mean(axis=1), 2.0 * R)[0].max() > 1.05 * R
    assert all(number % 2 == 0 for number in facets_at_edges(triangles))


def test_the_tip_of_a_pit_over_a_hole_narrower_than_the_ball_is_not_cut_off():
    """The ball touches the hole's edge all round; the tip is somewhere in a cell of the grid, whose walls are steep."""
    radius, far = 0.94 * R, 0.02
    hole = trimesh.creation.annulus(radius, 4.0 * radius, 0.01, sections=96)
    tip = 0.005 + np.sqrt(R**2 - radius**2)
    for k in range(12):  # each moves the grid
        low = -far - np.random.default_rng(k).uniform(0.0, 0.25 * R, 3)
        part = joined((hole.vertices, hole.faces), box(low, (-far + 1e-3,) * 3))
        vertices, _ = offset(part, parts=8)
        inside = (np.hypot(*vertices[:, :2].T) < 0.5 * radius) & (vertices[:, 2] > 0.0)
        assert vertices[inside, 2].min() == pytest.approx(tip, abs=0.03 * R)


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


@settings(max_examples=examples(6, 15), deadline=None)
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


@pytest.mark.parametrize("view", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8)])
def test_offset_in_a_window_through_a_part_is_that_of_the_whole_part_to_the_bit(view):
    """A solid block with a slot: the window cuts through the solid, where a mirrored sheet is within the block."""
    part = joined(
        box((0.0, 0.0, 0.0), (0.04, 0.012, 0.005)), box((0.0, 0.0, 0.005), (0.018, 0.012, 0.008)),
        box((0.021, 0.0, 0.005), (0.04, 0.012, 0.008)),
    )  # fmt: skip
    low, high = np.array([0.016, 0.003, 0.002]), np.array([0.026, 0.006, 0.0105])
    window = Window(np.stack([low, high]), np.array(view))
    whole = offset(part, distance=1e-3, step=2e-4, parts=4)
    cut = offset_surface(FacetTree.of(part), 1e-3, 2e-4, 4, window)
    assert len(cut[1]) < 0.6 * len(whole[1])

    def within(vertices, triangles):
        return vertices[triangles[((vertices > low) & (vertices < high)).all(axis=1)[triangles].all(axis=1)]]

    assert len(within(*whole)) > 500
    np.testing.assert_array_equal(within(*cut), within(*whole))


def test_a_part_too_large_for_the_ball_is_refused():
    with pytest.raises(MeshError, match=r"too fine for this part, which is 3,000 mm wide.*; is the unit"):
        offset(Mesh.of(*box([0.0] * 3, [3.0] * 3)), 1e-4, 2.5e-5)


def wedge(angle, length=0.04, high=0.03):
    """Two flanks that meet at the bottom of a groove along x, `angle` radians between them."""
    y, z = high * np.tan(0.5 * angle), high
    vertices = [(x, sign * y, z) for x in (0.0, length) for sign in (-1.0, 1.0)] + [(0.0, 0.0, 0.0), (length, 0.0, 0.0)]
    return Mesh.of(np.array(vertices), np.array([[0, 4, 5], [0, 5, 2], [1, 3, 5], [1, 5, 4]]))


def distances(part, points):
    """Distances from a mesh, by brute force."""
    return np.array([facet_distances(part.vertices[part.faces], point).min() for point in points])


@pytest.mark.parametrize("degrees", [5.0, 20.0, 60.0, 120.0])
def test_points_between_two_flanks_are_moved_to_where_the_ball_touches_them(degrees):
    """Where the flanks are steep, that is straight above the groove's bottom, at the same place along it."""
    half, count = 0.5 * np.radians(degrees), 100
    part, height, rng = wedge(2.0 * half, high=0.15), R / np.sin(half), np.random.default_rng(4)
    below = rng.uniform(0.0, 0.2 * R, count)
    aside = below * min(np.tan(half), 1.0 / np.tan(half)) * rng.uniform(-0.9, 0.9, count)
    start = np.stack([rng.uniform(0.015, 0.025, count), aside, height - below], axis=1)
    points, gaps = onto_level(FacetTree.of(part), start, R, 30, 1e-9)
    np.testing.assert_allclose(gaps, R, rtol=1e-9)
    np.testing.assert_allclose(distances(part, points), R, rtol=1e-8)
    both = np.stack([start[:, 0], np.zeros(count), np.full(count, height)], axis=1)
    if degrees < 90.0:
        np.testing.assert_allclose(points, both, atol=1e-9)
    assert (np.linalg.norm(points - start, axis=1) <= 1.2 * np.linalg.norm(both - start, axis=1)).all()


def test_points_in_a_pit_of_many_facets_are_moved_onto_the_level():
    """At the bottom of a cone of 24 facets, steep and shallow: the ball touches three or more of them."""
    for steep in (0.5, 2.0, 8.0):
        cone = trimesh.creation.cone(0.01, steep * 0.01, sections=24)
        part = Mesh.of(cone.vertices * [1.0, 1.0, -1.0], cone.faces[:, ::-1])
        side = part.facet_normals[:, 2] < 0.99
        part = Mesh.of(part.vertices, part.faces[side])
        tip = R * np.sqrt(1.0 + steep**2) - steep * 0.01
        start = np.array([0.0, 0.0, tip]) + 0.1 * R * np.random.default_rng(1).uniform(-1.0, 1.0, (200, 3))
        points, gaps = onto_level(FacetTree.of(part), start, R, 30, 1e-9)
        np.testing.assert_allclose(gaps, R, rtol=1e-9)
        np.testing.assert_allclose(distances(part, points), R, rtol=1e-8)
        assert np.linalg.norm(points - start, axis=1).max() < 0.5 * R


def test_a_point_in_a_gap_too_narrow_for_the_ball_is_told():
    walls = joined(box((0.0, 0.0, 0.0), (0.01, 0.04, 0.04)), box((0.01 + 1.9 * R, 0.0, 0.0), (0.03, 0.04, 0.04)))
    inside, above = (0.01 + 0.9 * R, 0.02, 0.02), (0.01 + 0.9 * R, 0.02, 0.04 + 0.2 * R)
    points, gaps = onto_level(FacetTree.of(walls), np.array([inside, above]), R, 30, 1e-9)
    assert gaps[0] < 0.96 * R
    assert gaps[1] == pytest.approx(R, rel=1e-9)
    np.testing.assert_allclose(gaps, distances(walls, points), rtol=1e-9)
