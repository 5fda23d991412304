"""Planes where edges cross a level of the distance from a block: against its closed form."""

from __future__ import annotations

import numpy as np
import trimesh

from pentapod.mesh.mesh import Mesh
from pentapod.mesh.offset.offset_kernels import cross_level
from pentapod.mesh.query.tree import FacetTree

HALF = np.array([0.01, 0.006, 0.004])
LEVEL, EDGE = 3e-3, 0.75e-3


def gradient(points):
    """Vectors from a block with middle at zero to points outside."""
    return points - np.clip(points, -HALF, HALF)


def test_planes_touch_the_level_beside_their_edges():
    shape = trimesh.creation.box(2.0 * HALF)
    tree, rng = FacetTree.of(Mesh.of(shape.vertices, shape.faces)), np.random.default_rng(6)
    starts = rng.uniform(-HALF - 1.4 * LEVEL, HALF + 1.4 * LEVEL, (20_000, 3))
    axes = rng.integers(0, 3, len(starts)).astype(np.intp)
    ends = starts + EDGE * np.eye(3)[axes]
    first, last = (np.linalg.norm(gradient(p), axis=1) > LEVEL for p in (starts, ends))
    rows = np.flatnonzero(first != last)
    assert len(rows) > 500
    starts, axes = np.ascontiguousarray(starts[rows]), axes[rows]
    points, normals = np.empty_like(starts), np.empty_like(starts)
    lengths = np.full(len(rows), EDGE)
    cross_level(starts, axes, lengths, first[rows], LEVEL, tree.corners, tree.starts, tree.extents, points, normals)
    away = gradient(points)
    distances = np.linalg.norm(away, axis=1)
    np.testing.assert_allclose(distances, LEVEL, rtol=2e-6)
    # A level crossed at a small angle has its edge along the plane: the normal is that of a place near by.
    np.testing.assert_allclose(normals, away / distances[:, None], atol=2e-3)
    along = np.take_along_axis(points - starts, axes[:, None], axis=1)[:, 0]
    beside = np.linalg.norm(points - starts - along[:, None] * np.eye(3)[axes], axis=1)
    assert beside.max() < 1.001e-3 * LEVEL
    assert along.min() > -1.001e-3 * LEVEL
    assert along.max() < EDGE + 1.001e-3 * LEVEL
