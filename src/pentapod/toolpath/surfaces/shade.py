"""What of a patch lies far in the shade: no tool gets there, and lines on it are left out in the end."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools
from pentapod.mesh.patch import Patch
from pentapod.numerics.threads import nearest_points


def out_of_the_shade(patch: Patch, hidden: Bools, reach: float) -> Patch:
    """Return a patch without its hidden facets (F,), but for those near others: `reach` to twice that, metres.

    So it ends where nothing can be machined. A patch all of which is hidden is returned as it is.
    """
    if not hidden.any() or hidden.all():
        return patch
    cell = np.floor(patch.vertices[patch.faces].mean(axis=1) / reach).astype(np.int64)
    cell -= cell.min(axis=0)
    packed = np.ravel_multi_index(tuple(cell.T), tuple((cell.max(axis=0) + 1).tolist()))
    _, first, which = np.unique(packed, return_index=True, return_inverse=True)
    cells, free = cell[first], np.bincount(which[~hidden], minlength=len(first)) > 0
    near = np.asarray(nearest_points(KDTree(cells[free]), cells, p=np.inf, distance_upper_bound=1.5)[0])[which] < np.inf
    return patch if near.all() else patch.only(near)
