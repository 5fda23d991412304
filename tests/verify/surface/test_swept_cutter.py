"""Where rays enter the swept volume of a flat end: against dense samples of a cylinder, in plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from pentapod.geometry.directions import normalised
from pentapod.verify.surface.swept_cutter import SweptSolid

RADIUS, LONG = 3e-3, 0.012


def swept(count, rng, turn=0.0):
    """A cylinder that leans and goes along `count` short stretches in all directions; turn: of its axis, about."""
    axis = np.array([0.2, 0.1, 1.0]) / np.linalg.norm([0.2, 0.1, 1.0])
    start = rng.uniform([0.0, 0.0, -2e-3], [0.03, 0.03, 2e-3], (count, 3))
    way = rng.normal(size=(count, 3)) * [4e-3, 4e-3, 4e-4]
    first, last = (normalised(axis + turn * rng.uniform(-1.0, 1.0, (count, 3))) for _ in range(2))
    numbers = np.array([0.0, LONG, RADIUS, RADIUS, 0.0])
    solid = SweptSolid.along((start, start + way), (first, last), np.zeros(count), numbers, is_ball=False, near=1e-6)
    return solid, start, way, axis


def is_inside(points, start, way, axis):
    """Which of points (n, 3) one of dense places of the cylinder holds: for each stretch those that may be near it."""
    inside = np.zeros(len(points), dtype=bool)
    reach = np.hypot(LONG, RADIUS)
    for first, along in zip(start, way, strict=True):
        near = np.flatnonzero(~inside & (np.linalg.norm(points - first, axis=1) < reach + np.linalg.norm(along)))
        offsets = points[near, None] - first - np.linspace(0.0, 1.0, 801)[:, None] * along
        height = offsets @ axis
        out = np.sqrt(np.maximum(np.einsum("psi,psi->ps", offsets, offsets) - height**2, 0.0))
        inside[near] = ((height >= 0.0) & (height <= LONG) & (out <= RADIUS)).any(axis=1)
    return inside


@pytest.mark.parametrize("most", [9e-4, pytest.param(6e-3, marks=pytest.mark.slow)])
def test_rays_enter_where_the_cylinder_is_first_and_not_before(most):
    rng = np.random.default_rng(5)
    solid, start, way, axis = swept(60, rng)
    points = rng.uniform([-4e-3, -4e-3, -8e-3], [0.034, 0.034, 0.0], (150, 3))
    normals = rng.normal(size=(150, 3)) * [0.3, 0.3, 1.0]
    normals[:, 2] = np.abs(normals[:, 2])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    heights = np.full(len(points), most)
    solid.entries(points, normals, heights)
    entered = heights < most
    assert 20 < entered.sum() < 130
    for point, normal, height in zip(points, normals, heights, strict=True):
        before = np.arange(0.0, height - 1e-6, 1e-4)[:, None]
        assert not is_inside(point + before * normal, start, way, axis).any()
        if height < most:
            assert is_inside((point + (height + 3e-5) * normal)[None], start, way, axis)[0]


def test_an_axis_that_hardly_turns_counts_as_fixed_and_finds_the_same():
    """Turned by 1e-9 it is fixed, by 3e-5 it is not: entries, distances and cells differ by no more than that."""
    found = []
    for turn in (1e-9, 3e-5):
        rng = np.random.default_rng(8)
        solid = swept(60, rng, turn)[0]
        assert (solid.frame is not None) == (turn < 1e-8)
        rng = np.random.default_rng(9)
        points = rng.uniform([-4e-3, -4e-3, -8e-3], [0.034, 0.034, 4e-3], (400, 3))
        normals = normalised(rng.normal(size=(400, 3)) * [0.3, 0.3, 1.0])
        heights, gaps = np.full(len(points), 6e-3), np.full(len(points), np.inf)
        solid.entries(points, normals, heights)
        solid.distances(points, gaps)
        corners = np.array([[[0.0, 0.0, 1e-3], [0.03, 0.0, 2e-3], [0.0, 0.03, 3e-3]]])
        cells, deepest = solid.uncovered(corners, np.array([[0.0, 0.0, 1.0]]), 1e-3, 1e-3, 2e-4)
        area = np.linalg.norm(np.cross(cells[:, 3:6] - cells[:, :3], cells[:, 6:9] - cells[:, :3]), axis=1).sum()
        found.append((heights, gaps, area, deepest))
    (heights, gaps, area, deepest), (other_heights, other_gaps, other_area, other_deepest) = found
    assert gaps == pytest.approx(other_gaps, abs=5e-6)
    assert 20 < (gaps < 0.0).sum() < 380
    assert heights == pytest.approx(other_heights, abs=5e-5)
    assert area == pytest.approx(other_area, rel=0.02)
    assert 0.0 < area < 8e-4
    assert deepest[0] == pytest.approx(other_deepest[0], abs=5e-5)
