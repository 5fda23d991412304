"""Drop cutter: where a cutter comes to rest that is lowered onto a mesh.

For a ball it is the part of the offset surface that is seen from above, without its overhangs and walls. It shares no
formula with `offset_surface`: tests hold what that leaves on a part against what this does.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.mesh.query.tree import FacetTree
from pentapod.numerics.threads import for_rows


def drop_cutter(tree: FacetTree, places: Floats, radius: float, disc: float = 0.0) -> Floats:
    """Return the height (N,) of the centre of a ball of `radius` metres that is dropped along −z at places (N, 2).

    disc: for a bull-nose end, or a flat end of no `radius`: that of the disc around which it is rounded, metres; the
    height is the disc's, `radius` above the tip. −inf where the cutter meets nothing. Heights are exact.
    """
    from pentapod.mesh.offset.drop_kernels import drop_all  # noqa: PLC0415 - loads numba

    heights, touches = np.empty(len(places)), np.empty((len(places), 4))
    given = (radius, disc, tree.corners, tree.starts, tree.extents)
    for_rows(drop_all, (np.ascontiguousarray(places),), given, (heights, touches))
    return heights
