"""Geodesic distance: closed forms on surfaces that unroll, whatever their facets; exact MMP of pygeodesic elsewhere."""

import numpy as np
import pytest

from pentapod.mesh.geodesic.distance import GeodesicField, GeodesicOptions, Sources
from pentapod.mesh.geodesic.places import PatchOn
from pentapod.mesh.patch import Patch
from pentapod.toolpath import Mesh
from toolpath_surfaces import sphere, torus

STEP = 1e-3
PERCENT = 1e-2


def strips(aspect, size=20.0, facets=1500):
    """A square in thin triangles, in millimetres."""
    rows = int(np.sqrt(0.5 * facets * aspect))
    columns = max(2, round(0.5 * facets / rows))
    x, y = np.meshgrid(np.linspace(0, size, columns + 1), np.linspace(0, size, rows + 1))
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    a, n = (j * (columns + 1) + i).ravel(), columns + 1
    faces = np.concatenate([np.stack([a, a + 1, a + n + 1], 1), np.stack([a, a + n + 1, a + n], 1)])
    return np.stack([x.ravel(), y.ravel()], 1), faces


def patch_of(points, faces):
    return Patch.whole(Mesh.of(1e-3 * points, faces))


def flat(points):
    return np.column_stack([points, np.zeros(len(points))])


def unrolled_onto(kind, points):
    """Points of the plane (N, 2), millimetres, on a plane, a cylinder or a cone, without change of length."""
    x, y = points.T
    if kind == "plane":
        return flat(points)
    if kind == "cylinder":
        return np.column_stack([10 * np.sin((x - 10) / 10), y, 10 * np.cos((x - 10) / 10)])
    slant, turn = np.hypot(x - 10, y + 8), np.arctan2(x - 10, y + 8)
    sine = 0.8  # of half the opening: the unrolled angle is that share of the turn about the axis
    return np.column_stack([slant * sine * np.sin(turn / sine), slant * sine * np.cos(turn / sine), -0.6 * slant])


def places(patch, count=2000):
    random = np.random.default_rng(5)
    return random.integers(0, len(patch.faces), count), random.dirichlet([1, 1, 1], count)


def mixed(values, patch, facets, weights):
    return (values[patch.faces[facets]] * weights[:, :, None]).sum(axis=1)


def to_segments(points, begins, ends):
    along = ends - begins
    square = np.maximum((along * along).sum(axis=1), 1e-300)
    share = np.clip(((points[:, None] - begins) * along).sum(axis=2) / square, 0, 1)
    return np.linalg.norm(points[:, None] - begins - share[:, :, None] * along, axis=2).min(axis=1)


@pytest.mark.parametrize("aspect", [1, 10, 100, 1000])
def test_distance_from_a_point_is_straight_on_a_plane_of_any_triangles(aspect):
    points, faces = strips(aspect)
    patch = patch_of(flat(points), faces)
    at = np.array([0.2, 0.3, 0.5])
    field = GeodesicField.of(patch, Sources.points(np.array([len(faces) // 2]), at[None]), 1.0 / STEP)
    source = at @ patch.vertices[patch.faces[len(faces) // 2]]
    np.testing.assert_allclose(field.values, np.linalg.norm(patch.vertices - source, axis=1) / STEP, atol=1e-7)
    facets, weights = places(patch)
    inside = np.linalg.norm(mixed(patch.vertices, patch, facets, weights) - source, axis=1) / STEP
    np.testing.assert_allclose(field.at(facets, weights), inside, atol=1e-7)


@pytest.mark.parametrize("aspect", [1, 30, 1000])
def test_distance_from_the_border_of_a_plane(aspect):
    points, faces = strips(aspect)
    patch = patch_of(flat(points), faces)
    field = GeodesicField.of(patch, Sources.sides(patch, patch.topology.facets_at_edge == 1), 1.0 / STEP)
    facets, weights = places(patch)
    at = mixed(patch.vertices, patch, facets, weights)[:, :2] / STEP
    np.testing.assert_allclose(field.at(facets, weights), np.minimum(at, 20 - at).min(axis=1), atol=PERCENT)


@pytest.mark.parametrize("kind", ["plane", "cylinder", "cone"])
@pytest.mark.parametrize("aspect", [1, 100, 1000])
def test_distance_from_a_line_of_segments_is_that_of_the_unrolled_surface(kind, aspect):
    """The unrolled facets differ from those of the curved surface by their sag, in millionths of a millimetre here."""
    points, faces = strips(aspect, facets=3000)
    if kind != "plane":  # rows of strips run around: turned, so that each strip is straight
        points = points[:, ::-1].copy()
        faces = faces[:, ::-1].copy()
    if kind == "cone":  # strips are along lines through the tip
        slant, turn = points[:, 1] + 8, (points[:, 0] - 10) / 16
        points = np.column_stack([slant * np.sin(turn) + 10, slant * np.cos(turn) - 8])
    patch = patch_of(unrolled_onto(kind, points), faces)
    order = np.argsort(np.linalg.norm(points[faces].mean(axis=1) - 10, axis=1))[:40]
    random = np.random.default_rng(2)
    begins, ends = random.dirichlet([1, 1, 1], 40), random.dirichlet([1, 1, 1], 40)
    field = GeodesicField.of(patch, Sources(order, begins, ends), 1.0 / STEP)
    ends = [(points[faces[order]] * w[:, :, None]).sum(axis=1) for w in (begins, ends)]
    facets, weights = places(patch)
    at = (points[faces[facets]] * weights[:, :, None]).sum(axis=1)
    exact = to_segments(at, *ends)
    around = np.linalg.norm(points[faces] - np.roll(points[faces], 1, axis=1), axis=2).min(axis=1).max()
    sag = 0.0 if kind == "plane" else around**2 / 100
    assert np.isfinite(field.values).all()
    np.testing.assert_allclose(field.at(facets, weights), exact, atol=PERCENT + sag)


def test_distance_around_a_prism_of_long_strips():
    sides, radius, height = 64, 10.0, 60.0
    turn = 2 * np.pi * np.arange(sides) / sides
    ring = radius * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    i, j = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = np.concatenate([np.stack([i, j, j + sides], 1), np.stack([i, j + sides, i + sides], 1)])
    patch = patch_of(np.concatenate([ring, ring + np.array([0, 0, height])]), faces)
    start = int(np.argmax(patch.vertices @ [1.0, 0.0, -1.0]))
    facet, corner = (a[0] for a in np.nonzero(patch.faces == start))
    field = GeodesicField.of(patch, Sources.points(np.array([facet]), np.eye(3)[[corner]]), 1.0 / STEP)
    angle = np.abs(np.arctan2(patch.vertices[:, 1], patch.vertices[:, 0]))
    around = 2 * radius * np.sin(np.pi / sides) * angle / (2 * np.pi / sides)
    np.testing.assert_allclose(field.values, np.hypot(around, 1e3 * patch.vertices[:, 2]), atol=1e-9)


def noisy_sheet(cells=24):
    random = np.random.default_rng(1)
    x, y = np.meshgrid(np.linspace(0, 40, cells + 1), np.linspace(0, 40, cells + 1))
    points = np.stack([x, y, 3 * np.sin(x / 4) * np.sin(y / 5)], -1).reshape(-1, 3)
    i = np.arange(cells * (cells + 1)).reshape(cells, cells + 1)[:, :-1].ravel()
    n = cells + 1
    faces = np.concatenate([np.stack([i, i + 1, i + n + 1], 1), np.stack([i, i + n + 1, i + n], 1)])
    return points + random.normal(0, 0.05, points.shape), faces


@pytest.mark.parametrize("name", ["sphere", "torus", "sheet"])
def test_distance_on_curved_surfaces_matches_pygeodesic(name):
    geodesic = pytest.importorskip("pygeodesic.geodesic")
    points, faces = {"sphere": lambda: sphere(10.0, 3), "torus": lambda: torus(40.0, 15.0, (40, 20))}.get(
        name, noisy_sheet
    )()
    patch = patch_of(points, faces)
    source = len(patch.vertices) // 2
    exact = geodesic.PyGeodesicAlgorithmExact(1e3 * patch.vertices, patch.faces).geodesicDistances(np.array([source]))[
        0
    ]
    facet, corner = (a[0] for a in np.nonzero(patch.faces == source))
    sources = Sources.points(np.array([facet]), np.eye(3)[[corner]])
    unmerged = GeodesicField.of(patch, sources, 1.0 / STEP, options=GeodesicOptions(slack=0.0, turn=0.0))
    np.testing.assert_allclose(unmerged.values, exact, atol=1e-6)
    merged = GeodesicField.of(patch, sources, 1.0 / STEP)
    np.testing.assert_allclose(merged.values, exact, atol=PERCENT)
    assert merged.values.max() > 20.0


def test_distance_goes_around_a_hole():
    """From one side of a slit to the other: two straight ways that turn at its ends."""
    points, faces = strips(1, facets=3200)
    middle = 0.5 * np.floor(points[faces].mean(axis=1) / 0.5) + 0.25  # of the cell of each pair of triangles
    hole = (np.abs(middle[:, 0] - 10) < 2) & (np.abs(middle[:, 1] - 10) < 5)
    patch = patch_of(flat(points), faces[~hole])
    at = 1e3 * patch.vertices[:, :2]
    low, high = np.array([8, 5]), np.array([12, 15])
    start = int(np.argmin(np.linalg.norm(at - [4, 10], axis=1)))
    facet, corner = (a[0] for a in np.nonzero(patch.faces == start))
    field = GeodesicField.of(patch, Sources.points(np.array([facet]), np.eye(3)[[corner]]), 1.0 / STEP)
    end = int(np.argmin(np.linalg.norm(at - [17, 10.2], axis=1)))
    ways = [
        np.linalg.norm(at[start] - [low[0], y]) + (high[0] - low[0]) + np.linalg.norm(at[end] - [high[0], y])
        for y in (low[1], high[1])
    ]
    assert field.values[end] == pytest.approx(min(ways), abs=PERCENT)


def test_distance_is_infinite_only_where_nothing_connects():
    points, faces = strips(100, facets=400)
    patch = patch_of(
        np.concatenate([flat(points), flat(points) + np.array([30, 0, 0])]),
        np.concatenate([faces, faces + len(points)]),
    )
    field = GeodesicField.of(patch, Sources.points(np.array([0]), np.array([[1.0, 0.0, 0.0]])), 1.0 / STEP)
    np.testing.assert_array_equal(np.isfinite(field.values), patch.vertices[:, 0] < 25e-3)


def test_distance_is_known_on_refined_facets():
    points, faces = strips(100, facets=100)
    patch = patch_of(flat(points), faces)
    field = GeodesicField.of(patch, Sources.sides(patch, patch.topology.facets_at_edge == 1), 1.0 / STEP)
    drawn = PatchOn.of(patch, lambda whole: whole.refined(1.5e-3))
    at = drawn.patch.vertices[:, :2] / STEP
    np.testing.assert_allclose(drawn.at_vertices(field.at), np.minimum(at, 20 - at).min(axis=1), atol=1e-4)
    facets, weights = places(drawn.patch, 300)
    at = mixed(drawn.patch.vertices, drawn.patch, facets, weights)[:, :2] / STEP
    np.testing.assert_allclose(drawn.carried(field.at)(facets, weights), np.minimum(at, 20 - at).min(axis=1), atol=1e-4)
