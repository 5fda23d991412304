"""Drop cutter: where a ball comes to rest that is lowered onto a mesh.

It is the part of the offset surface that is seen from above, without its overhangs and walls. It shares no formula with
`offset_surface`: tests hold what that leaves on a part against what this does.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.mesh.query.tree import FacetTree


def drop_cutter(tree: FacetTree, places: Floats, radius: float) -> Floats:
    """Return the height (N,) of the centre of a ball of `radius` metres that is dropped along −z at places (N, 2).

    −inf where it meets nothing. Heights are exact.
    """
    from pentapod.mesh.offset.drop_kernels import drop_all  # noqa: PLC0415 - loads numba

    heights = np.empty(len(places))
    drop_all(np.ascontiguousarray(places), radius, tree.corners, tree.starts, tree.extents, heights)
    return heights
