"""Rim of a patch: what is near its borders, against distances to each of them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import KDTree

from pentapod import Mesh
from pentapod.mesh.patch import Patch


@pytest.mark.parametrize("width", [0.004, 0.02, 0.2])
def test_rim_of_a_disc_is_what_lies_near_its_border(width):
    """The border is round: its middle is as far from all of it."""
    turn, radii = 2.0 * np.pi * np.arange(60) / 60, np.linspace(0.0, 0.05, 26)[1:]
    rings = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    points = np.concatenate([np.zeros((1, 3)), *(radius * rings for radius in radii)])
    k, after = np.arange(60), (np.arange(60) + 1) % 60
    faces = [np.stack([0 * k, 1 + k, 1 + after], axis=1)]
    for j in range(len(radii) - 1):
        inner, outer = 1 + 60 * j, 61 + 60 * j
        faces += [np.stack([inner + k, outer + k, outer + after], axis=1)]
        faces += [np.stack([inner + k, outer + after, inner + after], axis=1)]
    patch = Patch.whole(Mesh.of(points, np.concatenate(faces)))
    rim, near = patch.rim(width, 0.002)
    sides = np.roll(rings, -1, axis=0) - rings
    border = KDTree(0.05 * (rings[:, None] + np.linspace(0.0, 1.0, 4)[:, None] * sides[:, None]).reshape(-1, 3))
    away = border.query(rim.vertices)[0]
    assert (near == (away < width))[np.abs(away - width) > 1e-6].all()
    assert near.any()
    assert near.all() == (width == 0.2)
    assert len(rim.faces) > 0
    assert border.query(rim.vertices[rim.faces].mean(axis=1))[0].max() < 2.0 * width + 0.0021
