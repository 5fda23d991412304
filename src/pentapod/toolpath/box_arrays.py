"""Boxes along the mean normals of runs of facets, without compiled kernels: one level of the tree at a time."""

from __future__ import annotations

import numpy as np

from pentapod.arrays import Floats, Ints


def fit_boxes(corners: Floats, starts: Ints, boxes: Floats) -> None:
    """Fill boxes (2 L − 1, 15) of the complete tree over facets (F, 3, 3) with leaves starts (L + 1,)."""
    leaves = len(starts) - 1
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    count = 1
    while count <= leaves:
        begins = starts[: -1 : leaves // count]
        owner = np.repeat(np.arange(count), np.diff(np.append(begins, len(corners))))
        axes = _axes(np.add.reduceat(cross, begins, axis=0))
        along = np.einsum("fjk,fak->fja", corners, axes[owner])
        low = np.minimum.reduceat(along.min(axis=1), begins, axis=0)
        high = np.maximum.reduceat(along.max(axis=1), begins, axis=0)
        # A hair's breadth more, for what rounding takes.
        slack = 1e-12 * (high - low) + 1e-15 * np.maximum(np.abs(low), np.abs(high))
        level = boxes[count - 1 : 2 * count - 1]
        level[:, 0:3] = np.einsum("na,nak->nk", 0.5 * (low + high), axes)
        level[:, 3:6] = 0.5 * (high - low) + slack
        level[:, 6:15] = axes.reshape(-1, 9)
        count *= 2


def _axes(normals: Floats) -> Floats:
    """Return three axes (N, 3, 3) each, the last along a normal (N, 3), the first from what is least along it."""
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(length < 1e-300, [0.0, 0.0, 1.0], normals / np.maximum(length, 1e-300))
    rows, least = np.arange(len(normals)), np.abs(normals).argmin(axis=1)
    across = -normals[rows, least][:, None] * normals
    across[rows, least] += 1.0
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return np.asarray(np.stack([across, np.cross(normals, across), normals], axis=1), dtype=np.float64)
