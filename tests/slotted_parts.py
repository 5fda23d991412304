"""Blocks with a slot as wide as a cutter, or nearly."""

import numpy as np
import trimesh


def slotted(width, turn=0.0, depth=5.0, below=0.0):
    """A block of 60 × 40 × 15 mm with a slot along x in the middle of its top, turned about z.

    below: by how much each side of the slot is farther out at its bottom.
    """
    half, bottom = 0.5 * width, 15.0 - depth
    foot = half + below
    profile = np.array(
        [(-20, 0), (20, 0), (20, 15), (half, 15), (foot, bottom), (-foot, bottom), (-half, 15), (-20, 15)]
    )
    corners = np.concatenate([np.c_[np.full(8, x), profile] for x in (-30.0, 30.0)])
    ends = np.array([(0, 1, 4), (0, 4, 5), (1, 2, 3), (1, 3, 4), (0, 5, 6), (0, 6, 7)])
    k, n = np.arange(8), (np.arange(8) + 1) % 8
    sides = np.concatenate([np.c_[k, n + 8, n], np.c_[k, k + 8, n + 8]])
    shape = trimesh.Trimesh(1e-3 * corners, np.concatenate([ends[:, ::-1], ends + 8, sides[:, ::-1]]), process=False)
    if shape.volume < 0.0:
        shape.invert()
    shape.apply_transform(trimesh.transformations.rotation_matrix(turn, [0.0, 0.0, 1.0]))
    return shape
