"""Penetration: against sphere, torus and plane with wall, sampled facets, and another CAM library's drop cutter."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import toolpath_surfaces as surfaces
from pentapod.base.errors import ToolpathError
from pentapod.cutters.ball import BallCutter
from pentapod.cutters.bull_nose import BullNose
from pentapod.cutters.flat_end import FlatEnd
from pentapod.cutters.lollipop import Lollipop
from pentapod.cutters.stand_off import StandOff
from pentapod.geometry.solids import Cone, Solid
from pentapod.mesh.query.swept_depth import RESOLUTION_M, TouchingBody, is_clear, meets, sweep, touch
from pentapod.mesh.query.tree import FacetTree
from pentapod.toolpath import Mesh, load_mesh

UP = np.array([0.0, 0.0, 1.0])
TOOLS = [
    BallCutter(3e-3, flute=8e-3, shank=(Cone(0.01, 2e-3, 2e-3),), holder=(Cone(0.01, 4e-3, 9e-3),)),
    BullNose(5e-3, 1.5e-3, flute=8e-3, holder=(Cone(0.02, 7e-3, 7e-3),)),
    FlatEnd(3e-3, flute=8e-3, shank=(Cone(0.01, 3e-3, 2e-3),)),
    Lollipop(4e-3, 1.5e-3, 0.02),
    StandOff(5e-3, shank=(Cone(0.01, 0.5e-3, 6e-3),)),
]


def tree_of(pair):
    return FacetTree.of(Mesh.of(*pair))


def plate(size=0.1):
    return surfaces.grid(lambda x, y: 0.0 * x, width=size, cells=4)


def near(found, expected):
    """Within the resolution that `sweep` states."""
    np.testing.assert_allclose(found, expected, atol=2 * RESOLUTION_M, rtol=0.011)


@pytest.mark.parametrize("tool", TOOLS[:4], ids=lambda t: type(t).__name__)
def test_depth_in_a_plane_is_the_offset(tool):
    tree = tree_of(plate())
    pressed = np.array([0.1e-3, 0.5e-3, 1.2e-3])
    tips = np.stack([[4e-3, 3e-3, -d] for d in pressed])
    found = touch(tree, tool, tips, np.tile(UP, (3, 1)))
    near(found.depths[:, 0], pressed)
    assert (found.depths[:, 1:] == -np.inf).all()
    above = touch(tree, tool, np.array([[0, 0, 2e-4]]), UP[None], threshold=-1e-3)
    near(above.depths[0, 0], -2e-4)


def test_depth_of_a_leaning_flat_end_is_that_of_its_rim():
    lean, radius = np.radians(10.0), 3e-3
    axis = np.array([np.sin(lean), 0.0, np.cos(lean)])
    found = touch(tree_of(plate()), FlatEnd(radius, flute=0.01), np.zeros((1, 3)), axis[None])
    # The lower rim lies radius · sin(lean) under the plane; the plane's point deepest in the cylinder is that far
    # from the bottom disc where the flank is not nearer: the lesser of h cos(lean) and the flank, balanced.
    x = np.linspace(-0.01, 0.01, 2_000_001)
    inside = np.minimum(x * np.sin(lean), radius - np.abs(x) * np.cos(lean))
    near(found.depths[0, 0], inside.max())


def test_depth_beside_a_wall_is_that_of_flank_and_holder():
    wall = np.array([[0.0, -0.1, 0.0], [0.0, 0.1, 0.0], [0.0, 0.1, 0.1], [0.0, -0.1, 0.1]])
    tree = tree_of((wall, np.array([[0, 1, 2], [0, 2, 3]])))
    tool = BallCutter(3e-3, flute=0.02, shank=(Cone(0.02, 2e-3, 2e-3),), holder=(Cone(0.02, 5e-3, 12e-3),))
    tips = np.stack([[-x, 0.01, 0.02] for x in (2e-3, 4e-3, 13e-3)])
    found = touch(tree, tool, tips, np.tile(UP, (3, 1)))
    # The wall meets the axis' plane in a line: the deepest point of that line, by brute force.
    heights = np.linspace(0.0, 0.06, 20_001)
    deep = [inside(tool.solids[-1], np.full_like(heights, x), heights).max() for x in (2e-3, 4e-3)]
    near(found.depths[0], [1e-3, -np.inf, deep[0]])
    near(found.depths[1, 2], deep[1])
    assert found.depths[1, 0] == -np.inf
    assert (found.depths[2] == -np.inf).all()
    assert found.facets[0, 0] in (0, 1)
    np.testing.assert_allclose(found.points[0, 0, 0], 0.0, atol=1e-12)


@pytest.mark.parametrize("ball", [True, False])
def test_depth_on_a_sphere_is_the_sag_between_points(ball):
    """Poses in contact, chords between: the ball's centre passes below its circle by r (1 − cos(step / 2))."""
    big, radius, step = 0.05, 5e-3, np.radians(6.0)
    tree = tree_of(surfaces.sphere(big, 6))
    angle = np.arange(5) * step
    normals = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], 1)
    if ball:
        tool, tips = BallCutter(radius), big * normals
        axes = normals
    else:  # an upright lollipop's neck keeps clear; the general kernel must find the same
        tool, axes = Lollipop(radius, 1e-3, 0.02), np.tile(UP, (5, 1))
        tips = tool.tips(big * normals, normals, axes)
    found = sweep(tree, tool, tips, axes, threshold=1e-5)
    sag = (big + radius) * (1 - np.cos(step / 2))
    # An icosphere of 82,000 facets lies up to 6 µm inside the sphere.
    np.testing.assert_allclose(found.depths[:, 0], sag, atol=8e-6)
    np.testing.assert_allclose(found.times[:, 0], 0.5, atol=0.12)
    assert not (touch(tree, tool, tips, axes, threshold=1e-5).deepest > 1e-5).any()


def test_depth_of_a_ball_larger_than_a_torus_groove():
    """A ball on the inner equator of a torus: along the ring the surface is hollow with radius R − r."""
    major, minor = 0.04, 0.015
    tree = tree_of(surfaces.torus(major, minor, (320, 160)))
    hollow = major - minor
    normal = np.array([-1.0, 0.0, 0.0])
    contact = hollow * np.array([1.0, 0.0, 0.0])
    for radius in (0.8 * hollow, 1.5 * hollow):
        tool = BallCutter(radius)
        found = touch(tree, tool, tool.tips(contact[None], normal[None], UP[None]), UP[None], threshold=2e-5)
        # On the equator at angle φ the surface is at hollow · (cos φ, sin φ); the centre at hollow − radius.
        phi = np.linspace(0, np.pi, 100_001)
        depth = radius - np.hypot(hollow * np.cos(phi) - (hollow - radius), hollow * np.sin(phi)).min()
        if depth < 1e-12:
            assert found.depths[0, 0] == -np.inf
        else:
            # Off the equator the tube bends away; a facet's chord lies up to 12 µm nearer the axis.
            np.testing.assert_allclose(found.depths[0, 0], depth, atol=3e-5)


def sampled(mesh, tool, tips, axes, count=800, steps=21):
    """Depth by brute force: many points of every facet, many poses on the way. An underestimate."""
    rng = np.random.default_rng(0)
    weights = np.concatenate([np.eye(3), rng.dirichlet([0.7] * 3, max(4, count // len(mesh.faces)))])
    points = (weights @ mesh.vertices[mesh.faces]).reshape(-1, 3)
    depth = np.full(3, -np.inf)
    start, end = tips + tool.tilt_centre * axes
    angle = np.arctan2(np.linalg.norm(np.cross(*axes)), axes[0] @ axes[1])
    for t in np.linspace(0, 1, steps):
        if angle > 1e-9:
            axis = (np.sin((1 - t) * angle) * axes[0] + np.sin(t * angle) * axes[1]) / np.sin(angle)
        else:
            axis = axes[0]
        w = points - (start + t * (end - start)) + tool.tilt_centre * axis
        z = w @ axis
        r = np.linalg.norm(w - z[:, None] * axis, axis=1)
        for solid in tool.solids:
            kind = ("cutter", "shank", "holder").index(solid.kind)
            depth[kind] = max(depth[kind], inside(solid, r, z).max())
    return depth


def inside(solid, r, z):
    """Depth of (r, z) in a solid: distance from its outline, by shapely-free polygon arithmetic; −1 outside."""
    fine = np.linspace(0, 1, 801)
    corner = [(0.0, solid.low), (solid.low_radius, solid.low), (solid.high_radius, solid.high), (0.0, solid.high)]
    line = np.concatenate([np.outer(1 - fine, a) + np.outer(fine, b) for a, b in pairwise(corner)])
    from scipy.spatial import cKDTree

    distance = cKDTree(line).query(np.stack([r, z], 1))[0]
    share = np.clip((z - solid.low) / max(solid.high - solid.low, 1e-300), 0, 1)
    radius = solid.low_radius + share * (solid.high_radius - solid.low_radius)
    within = (z >= solid.low) & (z <= solid.high) & (r <= radius)
    return np.where(within, distance, -distance) + solid.rounding


@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 100_000), which=st.integers(0, len(TOOLS) - 1))
def test_depth_of_random_motions_is_at_least_that_of_samples(seed, which):
    rng, tool = np.random.default_rng(seed), TOOLS[which]
    vertices = rng.uniform(-0.012, 0.012, (12, 3)) - 0.004 * UP
    mesh = Mesh.of(vertices, np.arange(12).reshape(4, 3))
    tips = rng.uniform(-0.006, 0.006, (2, 3))
    axes = UP + rng.normal(size=(2, 3)) * rng.choice([0.0, 0.05, 0.5])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    found = sweep(FacetTree.of(mesh), tool, tips, axes, threshold=-0.002).depths[0]
    depth = sampled(mesh, tool, tips, axes)
    seen = depth > -0.002
    assert (found[seen] >= depth[seen] - 2 * RESOLUTION_M - 0.011 * np.abs(depth[seen]) - 1e-5).all()
    # And not deeper than the samples miss: 200 points a facet lie 2 mm apart, 20 steps 1 mm at most.
    assert (found[seen] <= depth[seen] + 2.5e-3).all()
    assert (found[~seen] <= -0.002 + 2.5e-3).all()


@settings(max_examples=24, deadline=None)
@given(seed=st.integers(0, 100_000), which=st.integers(0, len(TOOLS) - 1))
def test_a_tool_that_does_not_turn_is_as_deep_as_at_the_best_of_many_places_on_its_way(seed, which):
    """And as one that turns by a little: that is searched for in another way."""
    rng, tool = np.random.default_rng(seed), TOOLS[which]
    tree = tree_of(surfaces.grid(lambda x, y: 3e-3 * np.sin(200 * x) * np.cos(150 * y), width=0.04, cells=20))
    tips = rng.uniform([-0.02, -0.02, -1e-3], [0.02, 0.02, 8e-3], (2, 3))
    axis = UP + 0.3 * rng.standard_normal(3)
    axis /= np.linalg.norm(axis)
    found = sweep(tree, tool, tips, np.stack([axis, axis]), threshold=-2e-3).depths[0]
    share = np.linspace(0.0, 1.0, 401)[:, None]
    places = (1.0 - share) * tips[0] + share * tips[1]
    at_rest = touch(tree, tool, places, np.tile(axis, (401, 1)), threshold=-2e-3).depths
    lever = tool.tilt_centre + 0.03
    turned = axis + 1e-7 * np.cross(axis, UP + 1e-3)
    other = sweep(tree, tool, tips, np.stack([axis, turned / np.linalg.norm(turned)]), threshold=-2e-3).depths[0]
    for one, many, more in zip(found, at_rest.max(axis=0), other, strict=True):
        if np.isfinite(one):
            slack = 2 * RESOLUTION_M + 0.011 * abs(one)
            assert one >= many - slack
            # Between two of these places the tool moves by no more than this.
            assert one <= many + slack + 0.5 * np.linalg.norm(tips[1] - tips[0]) / 400
            assert one == pytest.approx(more, abs=slack + 2e-7 * lever)


@settings(max_examples=12, deadline=None)
@given(
    seed=st.integers(0, 100_000),
    which=st.integers(0, len(TOOLS) - 1),
    threshold=st.sampled_from([-5e-4, 0.0, 5e-5]),
    turns=st.booleans(),
)
def test_meetings_are_where_the_depth_is_beyond_the_threshold(seed, which, threshold, turns):
    rng = np.random.default_rng(seed)
    tree = tree_of(surfaces.grid(lambda x, y: 3e-3 * np.sin(200 * x) * np.cos(150 * y), width=0.04, cells=20))
    tips = rng.uniform([-0.02, -0.02, -1e-3], [0.02, 0.02, 8e-3], (30, 3))
    tips[20:25] = tips[20]  # at rest
    axes = UP + 0.5 * rng.standard_normal((30, 3) if turns else 3) * np.ones((30, 1))
    axes[20:25] = axes[20]
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    tool = TOOLS[which]
    depths = sweep(tree, tool, tips, axes, threshold=threshold - 1e-5).deepest
    decided = np.abs(depths - threshold) > 4 * RESOLUTION_M
    met = meets(tree, tool, tips, axes, threshold=threshold)
    np.testing.assert_array_equal(met[decided], (depths > threshold)[decided])
    for k in range(29):
        assert is_clear(tree, tool, tips[k : k + 2], axes[k : k + 2], threshold=threshold) == (not met[k])
    assert is_clear(tree, tool, tips, axes, threshold=threshold) == (not met.any())


@pytest.mark.parametrize("name", ["1002_tray_bottom.STL", "octagonal_pocket.stl", "facade_infill_open_mid_res.stl"])
def test_depth_matches_the_drop_cutter_of_opencamlib_on_real_parts(parts, name):
    """Where its ball rests, ours touches; pressed on by 50 µm it gouges, by at most that."""
    ocl = pytest.importorskip("opencamlib", reason="opencamlib has no wheel for this Python")
    unit = "m" if name.startswith("octagonal") else "mm"
    mesh = load_mesh(parts / name, unit)
    surface = ocl.STLSurf()
    for corners in 1e3 * mesh.vertices[mesh.faces]:
        surface.addTriangle(ocl.Triangle(*(ocl.Point(*corner) for corner in corners)))
    low, high = mesh.bounds
    rng = np.random.default_rng(0)
    where = low[:2] + rng.uniform(0.05, 0.95, (60, 2)) * (high - low)[:2]
    drop = ocl.BatchDropCutter()
    drop.setSTL(surface)
    cutter = ocl.BallCutter(6.0, 50.0)  # the library keeps no reference of its own
    drop.setCutter(cutter)
    for x, y in 1e3 * where:
        drop.appendPoint(ocl.CLPoint(float(x), float(y), 1e3 * float(low[2]) - 10.0))
    drop.run()
    tips = 1e-3 * np.array([(p.x, p.y, p.z) for p in drop.getCLPoints()])
    resting = tips[:, 2] > low[2] - 9e-3
    tips = tips[resting]
    assert len(tips) > 30
    tree, axes = FacetTree.of(mesh), np.tile(UP, (len(tips), 1))
    tool = BallCutter(3e-3)
    at_rest = touch(tree, tool, tips, axes, threshold=-1e-4).depths[:, 0]
    # Its drop cutter is exact but for rounding; where an edge is met nearly along it, to a micrometre.
    np.testing.assert_allclose(at_rest, 0.0, atol=2e-6)
    pressed = touch(tree, tool, tips - 5e-5 * UP, axes).depths[:, 0]
    assert (pressed > 0.0).all()
    assert (pressed <= 5e-5 + 2e-6).all()


def test_gap_of_a_stem_from_long_facets_is_that_of_dense_samples():
    """Stems beside, along and across facets: many points of a facet are nearly as near as the nearest."""
    rng = np.random.default_rng(3)
    radius, low, high, thinnest = 2e-3, 2e-3, 0.06, 1e-4
    stem = TouchingBody((Solid("shank", low, high, radius, radius),))
    share = np.array([(i, j) for i in range(301) for j in range(301 - i)]) / 300.0
    for _ in range(60):
        middle = np.array([rng.uniform(2.05e-3, 4e-3), 0.0, rng.uniform(-0.01, 0.07)])
        corners = middle + rng.normal(scale=[thinnest, 0.02, 0.02], size=(3, 3))
        lean = rng.normal(scale=0.02, size=3) + UP
        axis = lean / np.linalg.norm(lean)
        points = corners[0] + share @ (corners[1:] - corners[0])
        height = points @ axis
        beside = np.linalg.norm(points - height[:, None] * axis, axis=1) - radius
        beyond = np.maximum(low - height, height - high)
        outside = np.hypot(np.maximum(beside, 0.0), np.maximum(beyond, 0.0))
        sampled = (outside + np.minimum(np.maximum(beside, beyond), 0.0)).min()
        tree = FacetTree.of(Mesh.of(corners, np.array([[0, 1, 2]])))
        found = -touch(tree, stem, np.zeros((1, 3)), axis[None], threshold=-1.0).depths[0].max()
        spacing = np.ptp(corners, axis=0).max() / 300.0
        assert sampled - spacing <= found <= sampled + 2 * RESOLUTION_M + 0.011 * abs(min(sampled, 0.0))


def test_sweep_refuses_a_single_pose():
    with pytest.raises(ToolpathError, match="two poses"):
        sweep(tree_of(plate()), TOOLS[0], np.zeros((1, 3)), UP[None])
