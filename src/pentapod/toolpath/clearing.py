"""Clearing: whether the tool stays clear of the part on a whole motion, proven by distances from below.

The part is stood for by points on it such that no point of the surface is further than `cover` from one of them, the
tool by balls along its axis that hold all of it. A ball that is `gap` away from the nearest point is at least
gap − cover away from the surface; between two poses it moves no further than to either of them and half the way. So a
motion is clear where gap − cover − radius − half a step is positive for all balls, and halved where it is not sure.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.spatial import KDTree

from pentapod.arrays import Floats
from pentapod.toolpath.mesh import Mesh
from pentapod.toolpath.tools import Tool

_MOST_POINTS = 2_000_000
_MOST_HALVINGS = 6
BODY_M = 0.05
"""How much of a tool that does not say how long it is counts, from the tip up, metres."""


class Clearing:
    """A mesh that motions are proven to be clear of. reach: distances about this large are told well, metres."""

    def __init__(self, mesh: Mesh, view: Floats, reach: float) -> None:
        self.mesh, self.view = mesh, view
        area = float(mesh.facet_areas.sum())
        # Two triangles of edge e for each of e² / 2 √3 of the area and more at the rims.
        self._edge = max(reach, float(np.sqrt(4.0 * area / _MOST_POINTS)))
        self.top = float((mesh.vertices @ view).max())

    @cached_property
    def _points(self) -> tuple[KDTree, float]:
        # No point of a triangle is further from its centroid than two thirds of a median, which is shorter than a side.
        small = _cut_small(self.mesh.vertices[self.mesh.faces], self._edge)
        centres = small.mean(axis=1)
        cover = np.linalg.norm(small - centres[:, None], axis=2).max()
        return KDTree(centres), float(cover)

    def clear(self, tips: Floats, axes: Floats, tool: Tool, margin: float) -> bool:
        """Return whether a tool that moves along tips (N, 3) with axes (N, 3) is proven `margin` off the part."""
        heights, radii = balls(tool)
        centres = tips + heights[:, None, None] * axes
        starts, ends = centres[:, :-1].reshape(-1, 3), centres[:, 1:].reshape(-1, 3)
        radius = np.repeat(radii + margin, len(tips) - 1)
        for _ in range(_MOST_HALVINGS):
            # What passes above the highest point of the part needs no search.
            low = np.minimum(starts @ self.view, ends @ self.view) <= self.top + radius
            starts, ends, radius = starts[low], ends[low], radius[low]
            if not len(starts):
                return True
            tree, cover = self._points
            middle = 0.5 * (starts + ends)
            enough = radius + cover + 0.5 * np.linalg.norm(ends - starts, axis=1)
            gap = np.asarray(tree.query(middle, distance_upper_bound=float(enough.max()))[0])
            if (gap < radius).any():
                return False
            unsure = gap <= enough
            starts, middle, ends = starts[unsure], middle[unsure], ends[unsure]
            if not len(starts):
                return True
            radius = np.tile(radius[unsure], 2)
            starts, ends = np.concatenate([starts, middle]), np.concatenate([middle, ends])
        return False


def _cut_small(corners: Floats, longest: float) -> Floats:
    """Return triangles (N, 3, 3) that together are the triangles `corners`, with no side above `longest`."""
    done: list[Floats] = []
    while len(corners):
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        long = sides.max(axis=1) > longest
        done.append(corners[~long])
        corners, worst = corners[long], sides[long].argmax(axis=1)
        a, b, c = (corners[np.arange(len(corners)), (worst + k) % 3] for k in range(3))
        middle = 0.5 * (a + b)
        corners = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return np.concatenate(done)


def balls(tool: Tool) -> tuple[Floats, Floats]:
    """Return heights above the tip along the axis, and radii (B,), of balls that together hold the tool, metres.

    A tool with `cover_balls` says so itself; of others a shank as wide as the ball counts, or for a beam nothing
    but its tip.
    """
    own = getattr(tool, "cover_balls", None)
    if own is not None:
        heights, radii = own()
        return np.asarray(heights), np.asarray(radii)
    radius = max(tool.pivot, 0.0)
    if radius <= 0.0:
        return np.zeros(1), np.zeros(1)
    # Balls a radius apart, a little wider than the shank, hold all of it.
    heights = np.arange(radius, BODY_M, radius)
    radii = np.full(len(heights), np.hypot(radius, 0.5 * radius))
    radii[0] = radius
    return heights, radii
