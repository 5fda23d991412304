"""Slicing and resampling against planes, circles and another slicer."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import toolpath_surfaces as surfaces
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.slicing import LevelSet, chained
from pentapod.mesh.topology import Topology
from pentapod.toolpath import Mesh, Region
from pentapod.toolpath.lines.resampling import resample, without_duplicates

ALL = Region(angle=np.pi / 2, direction=(0.0, 0.0, 1.0))
WHOLE_BALL = ([0.0, 1.0, 0.0], -0.045, 0.005, 19)


def level_set(mesh, planes, region=None):
    """`count` planes x · normal = first + k · step on a mesh, or its part in a region."""
    normal, first, step, count = planes
    patch = Patch.whole(mesh) if region is None else Patch.of(mesh, region)
    return LevelSet(patch, patch.vertices @ np.asarray(normal), first + step * np.arange(count))


def slice_mesh(mesh, planes, region=None):
    return level_set(mesh, planes, region).lines()


def test_slices_of_a_ball_are_closed_circles():
    mesh = Mesh.of(*surfaces.sphere())
    passes = slice_mesh(mesh, WHOLE_BALL)
    assert len(passes) == 19
    np.testing.assert_array_equal(passes.levels, np.arange(19))
    np.testing.assert_allclose(passes.points[passes.starts[:-1]], passes.points[passes.starts[1:] - 1], atol=1e-12)
    height = -0.045 + 0.005 * passes.levels
    np.testing.assert_allclose(passes.points[:, 1], height[passes.pass_of_point], atol=1e-12)
    np.testing.assert_allclose(passes.lengths, 2 * np.pi * np.sqrt(0.05**2 - height**2), rtol=5e-3)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), snapped=st.booleans())
def test_slices_are_as_long_as_those_of_trimesh(seed, snapped):
    """Total length in each plane against trimesh, on rotated tori; snapped: planes run exactly through vertices."""
    import trimesh
    from scipy.spatial.transform import Rotation

    vertices, faces = surfaces.torus(sections=(24, 12))
    vertices = vertices @ Rotation.random(random_state=seed).as_matrix().T
    mesh = Mesh.of(vertices, faces)
    first = float(mesh.vertices[seed % len(mesh.vertices), 0]) if snapped else -0.0313
    planes = ([1.0, 0.0, 0.0], first, 0.0071, 6)
    passes = slice_mesh(mesh, planes)
    shape = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    for plane in range(6):
        # Next to the plane, where the answer is the same and no vertex lies on it.
        level = first + plane * 0.0071 - 1e-9
        lines = trimesh.intersections.mesh_plane(shape, [1, 0, 0], [level, 0, 0])
        expected = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum() if len(lines) else 0.0
        assert passes.lengths[passes.levels == plane].sum() == pytest.approx(expected, abs=1e-6)
    # A closed surface is cut into closed lines.
    np.testing.assert_allclose(passes.points[passes.starts[:-1]], passes.points[passes.starts[1:] - 1], atol=1e-12)


def test_slices_through_rows_of_vertices_are_not_doubled():
    mesh = Mesh.of(*surfaces.grid(lambda x, y: 0.1 * x * y, cells=10))
    passes = slice_mesh(mesh, ([0.0, 1.0, 0.0], -0.05, 0.01, 11), ALL)
    # The lowest border counts as above its plane: it is not cut; the highest is.
    assert len(passes) == 10
    np.testing.assert_allclose(passes.lengths, 0.1, rtol=1e-4)


def test_slices_run_with_the_planes_normal_to_the_left():
    mesh = Mesh.of(*surfaces.grid(lambda x, y: 0 * x))
    passes = slice_mesh(mesh, ([0.0, 1.0, 0.0], -0.031, 0.02, 4), ALL)
    assert (passes.points[passes.starts[1:] - 1, 0] > passes.points[passes.starts[:-1], 0]).all()


@pytest.mark.parametrize("fold_deg", [30.0, 60.0])
def test_slices_end_at_creases_and_not_at_smooth_folds(fold_deg):
    slope = np.tan(np.radians(fold_deg / 2))
    mesh = Mesh.of(*surfaces.grid(lambda x, y: -slope * np.abs(x), cells=10))
    passes = slice_mesh(mesh, ([0.0, 1.0, 0.0], -0.031, 0.02, 4), ALL)
    assert len(passes) == (4 if fold_deg < 40 else 8)


def test_slices_end_exactly_at_the_region():
    mesh = Mesh.of(*surfaces.sphere())
    region = Region(angle=np.radians(50.0), box=((-0.02, -1, -1), (0.03, 1, 1)))
    passes = slice_mesh(mesh, WHOLE_BALL, region)
    points, normals = passes.points, passes.normals
    assert points[:, 0].min() == pytest.approx(-0.02, abs=1e-12)
    assert points[:, 0].max() == pytest.approx(0.03, abs=1e-12)
    tilt = np.degrees(np.arccos(normals[:, 2] / np.linalg.norm(normals, axis=1)))
    assert tilt.max() <= 50.0 + 1e-9
    ends = np.concatenate([passes.starts[:-1], passes.starts[1:] - 1])
    at_box = (np.abs(points[ends, 0] + 0.02) < 1e-9) | (np.abs(points[ends, 0] - 0.03) < 1e-9)
    # The edge of the cone runs straight through each facet, from side to side, where it is exact.
    assert np.abs(tilt[ends][~at_box] - 50.0).max() < 0.02
    patch = Patch.of(mesh, Region(angle=np.radians(50.0)))
    rim = np.unique(patch.topology.edges[patch.topology.facets_at_edge == 1])
    at_rim = patch.normals[np.isin(patch.faces, rim)]
    slopes = np.degrees(np.arccos(at_rim[:, 2] / np.linalg.norm(at_rim, axis=1)))
    np.testing.assert_allclose(slopes, 50.0, atol=1e-6)
    assert at_box.any()
    assert not at_box.all()


@settings(max_examples=50, deadline=None)
@given(st.data())
def test_chained_items_match_walking(data):
    count = data.draw(st.integers(1, 40))
    target = data.draw(st.permutations(range(count)))
    cut = data.draw(st.lists(st.booleans(), min_size=count, max_size=count))
    after = np.array([-1 if c else t for c, t in zip(cut, target, strict=True)])
    order, chain = chained(after)
    assert sorted(order) == list(range(count))
    for a, b, same in zip(order, order[1:], chain[1:] == chain[:-1], strict=False):
        assert not same or after[a] == b
    cycles = count - np.count_nonzero(after < 0) - np.count_nonzero(chain[1:] == chain[:-1])
    walked = 0  # closed chains, found by walking
    seen: set[int] = set()
    for start in range(count):
        path, at = [], start
        while at >= 0 and at not in seen:
            seen.add(at)
            path.append(at)
            at = int(after[at])
        walked += at in path
    assert cycles == walked


@settings(max_examples=25, deadline=None)
@given(chordal=st.floats(1e-6, 1e-4), spacing=st.floats(3e-4, 1e-2), seed=st.integers(0, 1000))
def test_resampling_holds_every_tolerance(chordal, spacing, seed):
    """Measured against the fine slice itself, on a smooth and on a coarse mesh."""
    a, b = np.random.default_rng(seed).uniform(20, 90, 2)
    mesh = Mesh.of(*surfaces.grid(lambda x, y: 0.006 * np.sin(a * x) * np.cos(b * y), cells=10 + seed % 90))
    fine = slice_mesh(mesh, ([0.0, 1.0, 0.0], -0.043, 0.02, 5), ALL)
    few = resample(fine, chordal=chordal, spacing=spacing, axis_step=np.radians(4.0), closest=1e-6)
    assert len(few) == len(fine)
    assert few.steps[few.within].max() <= spacing * (1 + 1e-6)
    assert few.steps[few.within].min() >= 1e-6 * (1 - 1e-6)
    np.testing.assert_array_equal(few.points[few.starts[:-1]], fine.points[fine.starts[:-1]])
    np.testing.assert_array_equal(few.points[few.starts[1:] - 1], fine.points[fine.starts[1:] - 1])
    for k in range(len(fine)):
        line = few.points[few.starts[k] : few.starts[k + 1]]
        for point in fine.points[fine.starts[k] : fine.starts[k + 1]]:
            d = np.diff(line, axis=0)
            t = np.clip(((point - line[:-1]) * d).sum(1) / (d * d).sum(1), 0, 1)
            assert np.linalg.norm(line[:-1] + t[:, None] * d - point, axis=1).min() <= chordal + 1e-6


@pytest.mark.parametrize("length", [1e-4, 1e-3])
def test_between_opposite_normals_points_are_no_nearer_than_asked(length):
    """Across a channel, where normals of both walls cancel: there were 40,000 waypoints in a millimetre."""
    line = np.array([[0.0, 0.0, 0.0], [5e-3, 0.0, 0.0], [5e-3 + length, 0.0, 0.0], [1e-2, 0.0, 0.0]])
    normals = np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, -1.0, 0.0]])
    few = resample(Passes.of([(line, normals)]), chordal=1e-5, spacing=2e-3, axis_step=0.05, closest=1e-5)
    assert few.steps.min() >= 1e-5 * (1.0 - 1e-9)
    assert few.lengths == pytest.approx([1e-2])


def test_resampling_is_even_where_only_the_spacing_binds():
    mesh = Mesh.of(*surfaces.grid(lambda x, y: 0 * x, cells=37))
    passes = slice_mesh(mesh, ([0.0, 1.0, 0.0], -0.043, 0.02, 5), ALL)
    few = resample(passes, chordal=1e-5, spacing=2e-3, axis_step=0.1, closest=1e-5)
    np.testing.assert_allclose(few.steps[few.within], 2e-3, rtol=1e-9)
    assert len(few.points) == 5 * 51


def test_without_duplicates_keeps_the_ends():
    mesh = Mesh.of(*surfaces.sphere(subdivisions=5))
    passes = slice_mesh(mesh, WHOLE_BALL, ALL)
    thinned = without_duplicates(passes, 3e-4)
    assert thinned.steps[thinned.within].min() >= 3e-4
    assert len(thinned) == len(passes)
    np.testing.assert_array_equal(thinned.points[thinned.starts[:-1]], passes.points[passes.starts[:-1]])
    np.testing.assert_array_equal(thinned.points[thinned.starts[1:] - 1], passes.points[passes.starts[1:] - 1])


@pytest.mark.parametrize(
    ("names", "left"),
    [
        ("abcbd", "abd"), ("abcbabe", "abe"), ("abcdcbe", "abe"), ("abbcb", "ab"), ("aba", ""), ("abca", "abca"),
        ("abcc", "abc"), ("abcbca", "abca"), ("ababa", ""),
    ],
)  # fmt: skip
def test_spikes_of_lines_are_left_out(names, left):
    """A line that leads to a point and straight back; other lines beside it, and closed ones, stay as they are."""
    places = {name: np.array([k, k * k, 0.0]) for k, name in enumerate("abcde")}
    lines = [np.array([places[name] for name in text]) for text in ("ade", names, "abca")]
    found = Passes.of([(line, line + 1.0) for line in lines]).without_spikes(1e-7)
    expected = ["ade", *([left] if left else []), "abca"]
    assert found.levels.tolist() == [0, *([1] if left else []), 2]
    for k, text in enumerate(expected):
        np.testing.assert_array_equal(found.points[found.rows(k)], [places[name] for name in text])
    np.testing.assert_array_equal(found.normals, found.points + 1.0)


def test_crossings_count_the_points_of_slices():
    mesh = Mesh.of(*surfaces.sphere())
    count = level_set(mesh, WHOLE_BALL).crossings
    assert len(slice_mesh(mesh, WHOLE_BALL).points) == count + 19


def test_topology_of_no_facets_is_empty():
    topology = Topology(np.zeros((0, 3), dtype=np.intp), 0)
    assert topology.edges.shape == (0, 2)
    assert topology.edge_of_side.shape == (0, 3)
    assert topology.border_loops == 0
