"""Distances to meshes: against trimesh's closest points on dense samples, and laws that distances obey."""

import gc
import weakref

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from pentapod.geometry.solids import Solid
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.mesh.query.tree import FacetTree

FAR = 0.3


def mesh_of(shape: trimesh.Trimesh) -> Mesh:
    return Mesh.of(np.asarray(shape.vertices), np.asarray(shape.faces))


SHAPES = {
    "box": trimesh.creation.box((0.12, 0.06, 0.04)),
    "ball": trimesh.creation.icosphere(3, 0.05),
    "ring": trimesh.creation.torus(0.06, 0.02, major_sections=24, minor_sections=12),
    "post": trimesh.creation.cylinder(0.01, 0.1, sections=20),
}


LARGE = 1e4
"""trimesh takes squared distances for equal that differ by less than 1e-8: it is asked in tenths of a millimetre."""


def oracle_distance(shape, points):
    """Signed distances of points, negative inside."""
    return -trimesh.proximity.signed_distance(shape.copy().apply_scale(LARGE), LARGE * points) / LARGE


@pytest.fixture(scope="module", params=SHAPES)
def shape(request):
    return SHAPES[request.param]


def segments(count, seed):
    rng = np.random.default_rng(seed)
    return rng.uniform(-0.15, 0.15, (count, 3)), rng.uniform(-0.15, 0.15, (count, 3))


def test_distances_of_points_match_trimesh(shape):
    rng = np.random.default_rng(1)
    at = np.concatenate([rng.uniform(-0.1, 0.1, (400, 3)), shape.sample(100, seed=2) * rng.uniform(0.9, 1.1, (100, 1))])
    found = MeshDistance.of(mesh_of(shape)).points(at)
    np.testing.assert_allclose(found.distance, oracle_distance(shape, at), atol=1e-9)


def test_the_normal_is_the_gradient_of_the_distance(shape):
    """A step along it changes the distance by its own length, wherever the nearest point is the only one near."""
    distance = MeshDistance.of(mesh_of(shape))
    at = np.random.default_rng(3).uniform(-0.1, 0.1, (400, 3))
    found = distance.points(at)
    moved = distance.points(at + 1e-6 * found.normal).distance - found.distance
    assert (np.abs(moved - 1e-6) < 1e-9).mean() > 0.97


def test_distances_of_segments_match_dense_samples(shape):
    distance = MeshDistance.of(mesh_of(shape))
    a, b = segments(15, 4)
    found = distance.segments(a, b)
    t = np.linspace(0.0, 1.0, 150)[:, None]
    for k in range(len(a)):
        samples = a[k] + t * (b[k] - a[k])
        oracle = oracle_distance(shape, samples).min()
        step = np.linalg.norm(b[k] - a[k]) / 149
        assert oracle - step <= found.distance[k] + 1e-9
        # Never more than a sample of it says; depths are sampled too.
        assert found.distance[k] <= oracle + (1e-9 if oracle > 0.0 else 1e-3)
        at = a[k] + found.place[k] * (b[k] - a[k])
        assert oracle_distance(shape, at[None])[0] == pytest.approx(found.distance[k], abs=1e-8)


def test_distances_are_capped(shape):
    distance = MeshDistance.of(mesh_of(shape))
    a, b = segments(200, 5)
    free, capped = distance.segments(a, b).distance, distance.segments(a, b, within=0.02).distance
    np.testing.assert_allclose(capped, np.minimum(free, 0.02), atol=1e-12)


def test_distances_of_tools_match_dense_samples_of_their_surface(shape):
    distance = MeshDistance.of(mesh_of(shape))
    solids = (Solid("shank", 0.0, 0.03, 0.004, 0.006), Solid("holder", 0.03, 0.06, 0.02, 0.025))
    rng = np.random.default_rng(6)
    tips, axes = rng.uniform(-0.1, 0.1, (12, 3)), rng.normal(size=(12, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    gap, _ = distance.bodies(solids, tips, axes, FAR)
    whole = trimesh.util.concatenate(
        [
            trimesh.creation.revolve(
                [(0, s.low), (s.low_radius, s.low), (s.high_radius, s.high), (0, s.high)], sections=48
            )
            for s in solids
        ]
    )
    local = np.concatenate([whole.sample(1500, seed=7), whole.vertices])
    for k in range(len(tips)):
        frame = trimesh.geometry.align_vectors([0, 0, 1], axes[k])[:3, :3]
        samples = local @ frame.T + tips[k]
        oracle = oracle_distance(shape, samples).min()
        if oracle > 0.0:  # every point of the surface has a sample within 6 mm
            assert oracle - 0.006 <= gap[k] <= oracle + 1e-6
        else:  # depths are of other points: of the mesh in the tool, not of the tool in the mesh
            assert gap[k] < 0.0


@given(
    st.tuples(*[st.floats(-0.1, 0.1)] * 3), st.tuples(*[st.floats(-0.1, 0.1)] * 3), st.tuples(*[st.floats(-1, 1)] * 3)
)
def test_distances_change_no_faster_than_the_body_moves(start, end, way):
    """The law that proofs between samples rest on."""
    distance = DISTANCES["ring"]
    ends = np.array([start]), np.array([end])
    step = 0.01 * np.array(way)
    before, after = distance.segments(*ends).distance[0], distance.segments(ends[0] + step, ends[1]).distance[0]
    sampled = 1e-3 if min(before, after) < 0.0 else 1e-9  # depths are those of the deepest sample
    assert abs(after - before) <= np.linalg.norm(step) + sampled


DISTANCES = {name: MeshDistance.of(mesh_of(shape)) for name, shape in SHAPES.items()}


def test_an_open_sheet_has_no_inside():
    x, y = np.meshgrid(np.linspace(-0.05, 0.05, 5), np.linspace(-0.05, 0.05, 5), indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(25)], axis=1)
    faces = [t for i in range(4) for j in range(4) for k in [5 * i + j] for t in ((k, k + 5, k + 6), (k, k + 6, k + 1))]
    distance = MeshDistance.of(Mesh.of(vertices, faces))
    assert not distance.closed
    found = distance.segments([[0.0, 0.0, -0.1], [0.0, 0.0, -0.1]], [[0.01, 0.0, 0.1], [0.0, 0.0, -0.02]])
    np.testing.assert_allclose(found.distance, [0.0, 0.02], atol=1e-12)
    assert not distance.contains([[0.0, 0.0, -0.01]]).any()


def test_winding_numbers_match_trimesh(shape):
    at = np.random.default_rng(8).uniform(-0.08, 0.08, (200, 3))
    np.testing.assert_array_equal(MeshDistance.of(mesh_of(shape)).contains(at), shape.contains(at))


def test_a_mesh_wound_inside_out_has_the_same_inside():
    box = SHAPES["box"]
    inverted = MeshDistance.of(Mesh.of(np.asarray(box.vertices), np.asarray(box.faces)[:, ::-1]))
    at = np.random.default_rng(9).uniform(-0.08, 0.08, (100, 3))
    np.testing.assert_allclose(inverted.points(at).distance, MeshDistance.of(mesh_of(box)).points(at).distance)


def test_tree_of_a_mesh_is_made_once_and_goes_with_it():
    mesh = mesh_of(trimesh.creation.box((0.011, 0.012, 0.013)))
    tree = FacetTree.of(mesh)
    assert MeshDistance.of(mesh).tree is tree
    assert FacetTree.of(Mesh.of(2.0 * mesh.vertices, mesh.faces)) is not tree
    gone = weakref.ref(tree)
    del mesh, tree
    gc.collect()
    assert gone() is None
