"""What of a patch lies far in the shade: no tool gets there, and lines on it are left out in the end."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_dilation

from pentapod.base.arrays import Bools
from pentapod.mesh.patch import Patch


def out_of_the_shade(patch: Patch, hidden: Bools, reach: float) -> Patch:
    """Return a patch without its hidden facets (F,), but for those near others: `reach` to twice that, metres.

    So it ends where nothing can be machined, and lines beside what can be are as they were.
    """
    if not hidden.any():
        return patch
    cell = np.floor(patch.vertices[patch.faces].mean(axis=1) / reach).astype(np.intp)
    cell -= cell.min(axis=0)
    free = np.zeros(cell.max(axis=0) + 1, dtype=np.bool_)
    free[tuple(cell[~hidden].T)] = True
    near: Bools = binary_dilation(free, np.ones((3, 3, 3), dtype=np.bool_))[tuple(cell.T)]
    return patch if near.all() else patch.only(near)
