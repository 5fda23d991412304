"""Where rays enter the swept volume of a flat end: against dense samples of a cylinder, in plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from pentapod.verify.surface.swept_cutter import SweptSolid

RADIUS, LONG, LEAVES = 3e-3, 0.012, 8


def swept(count, rng):
    """A cylinder that leans and goes along `count` short stretches in all directions."""
    axis = np.array([0.2, 0.1, 1.0]) / np.linalg.norm([0.2, 0.1, 1.0])
    start = rng.uniform([0.0, 0.0, -2e-3], [0.03, 0.03, 2e-3], (count, 3))
    start = start[np.argsort(start[:, 0])]  # so that a leaf's stretches are near to each other
    way = rng.normal(size=(count, 3)) * [4e-3, 4e-3, 4e-4]
    axes = np.tile(axis, (count, 1))
    ends = np.stack([start, start + LONG * axis, start + way, start + way + LONG * axis])
    starts = np.linspace(0, count, LEAVES + 1).astype(np.intp)
    boxes = np.empty((2 * LEAVES - 1, 6))
    for node in reversed(range(len(boxes))):
        leaf = node - (LEAVES - 1)
        if leaf >= 0:
            held = ends[:, starts[leaf] : starts[leaf + 1]].reshape(-1, 3)
            boxes[node] = [*held.min(axis=0), *held.max(axis=0)]
        else:
            one, other = boxes[2 * node + 1], boxes[2 * node + 2]
            boxes[node] = [*np.minimum(one[:3], other[:3]), *np.maximum(one[3:], other[3:])]
    rows = np.concatenate([start, way, axes, axes, np.zeros((count, 1))], axis=1)
    numbers = np.array([0.0, LONG, RADIUS, RADIUS, 0.0])
    return SweptSolid(np.ascontiguousarray(rows), boxes, starts, numbers, RADIUS, is_ball=False), start, way, axis


def is_inside(point, start, way, axis):
    """Whether one of dense places of the cylinder holds a point."""
    offsets = point - (start[:, None] + np.linspace(0.0, 1.0, 801)[:, None] * way[:, None])
    height = offsets @ axis
    out = np.linalg.norm(offsets - height[..., None] * axis, axis=-1)
    return bool(((height >= 0.0) & (height <= LONG) & (out <= RADIUS)).any())


@pytest.mark.parametrize("most", [9e-4, 6e-3])
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
        before = np.arange(0.0, height - 1e-6, 1e-4)
        assert not any(is_inside(point + t * normal, start, way, axis) for t in before)
        if height < most:
            assert is_inside(point + (height + 3e-5) * normal, start, way, axis)
