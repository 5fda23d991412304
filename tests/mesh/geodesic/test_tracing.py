"""Rays along a surface: where they end, against the unrolled surface."""

import numpy as np
import pytest

from pentapod.mesh.geodesic.tracing import SurfaceRays, neighbours, traced
from pentapod.mesh.patch import Patch
from pentapod.toolpath import Mesh


def prism(sides, radius, height, rings):
    """A tube of plane strips, cut into facets with random corners along the strips' edges, and its unrolling."""
    random = np.random.default_rng(3)
    turn = 2 * np.pi * np.arange(sides) / sides
    z = np.sort(random.uniform(0, height, (sides, rings)), axis=1)
    z[:, 0], z[:, -1] = 0, height
    points = np.stack([np.cos(turn)[:, None] + 0 * z, np.sin(turn)[:, None] + 0 * z, z / radius], -1) * radius
    i, j = np.meshgrid(np.arange(sides), np.arange(rings - 1), indexing="ij")
    a, b = (i * rings + j).ravel(), ((i + 1) % sides * rings + j).ravel()
    faces = np.concatenate([np.stack([a, b, b + 1], 1), np.stack([a, b + 1, a + 1], 1)])
    return Patch.whole(Mesh.of(points.reshape(-1, 3), faces)), 2 * radius * np.sin(np.pi / sides)


def unrolled(points, sides, radius, width):
    """Length (N,) around the prism, and height (N,)."""
    angle = np.mod(np.arctan2(points[:, 1], points[:, 0]), 2 * np.pi)
    strip = np.floor(angle / (2 * np.pi / sides))
    within = angle - (strip + 0.5) * 2 * np.pi / sides
    apothem = radius * np.cos(np.pi / sides)
    return strip * width + 0.5 * width + apothem * np.tan(within), points[:, 2]


def test_traced_rays_are_straight_lines_of_the_unrolled_prism():
    sides, radius, height = 64, 10e-3, 60e-3
    patch, width = prism(sides, radius, height, rings=9)
    random = np.random.default_rng(4)
    count = 300
    facets, weights = random.integers(0, len(patch.faces), count), random.dirichlet([1, 1, 1], count)
    slope, lengths = random.uniform(0, 2 * np.pi, count), random.uniform(0, 80e-3, count)
    around = np.cross([0.0, 0.0, 1.0], patch.facet_normals[facets])
    directions = np.cos(slope)[:, None] * around + np.sin(slope)[:, None] * np.array([0.0, 0.0, 1.0])
    start = SurfaceRays(facets, weights, directions, np.ones(count, bool))
    ends = traced(patch, neighbours(patch), start, lengths)
    begin, low = unrolled(start.points(patch), sides, radius, width)
    end, high = unrolled(ends.points(patch), sides, radius, width)
    reach = low + lengths * np.sin(slope)
    np.testing.assert_array_equal(ends.landed, (reach > 0) & (reach < height))
    landed = ends.landed
    assert 100 < landed.sum() < count
    np.testing.assert_allclose(high[landed], reach[landed], atol=1e-12)
    gap = np.mod(begin + lengths * np.cos(slope) - end + 0.5 * sides * width, sides * width) - 0.5 * sides * width
    np.testing.assert_allclose(gap[landed], 0.0, atol=1e-12)
    lifted = ends.directions[landed] @ [0.0, 0.0, 1.0]
    np.testing.assert_allclose(lifted, np.sin(slope)[landed], atol=1e-12)


@pytest.mark.parametrize("length", [0.0, 1e-15])
def test_traced_rays_of_no_length_stay(length):
    patch, _ = prism(8, 10e-3, 20e-3, rings=4)
    weights = np.array([[0.2, 0.3, 0.5]])
    start = SurfaceRays(np.array([5]), weights, patch.vertices[patch.faces[5, 1:2]] * 0 + [0, 0, 1.0], np.ones(1, bool))
    end = traced(patch, neighbours(patch), start, np.array([length]))
    assert end.facets[0] == 5
    assert end.landed[0]
    np.testing.assert_allclose(end.weights, weights, atol=1e-12)
