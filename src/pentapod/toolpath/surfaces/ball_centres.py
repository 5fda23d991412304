"""Centres of a ball that rolls over a part: put exactly on its offset, with chords and links that are proven clear.

A ball is clear at a centre whatever its axis. Chords are proven by their exact distance from the part.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Bools, Floats, row_lengths
from pentapod.geometry.directions import normalised
from pentapod.geometry.runs import marked_runs
from pentapod.mesh.normals import unit_or_zero
from pentapod.mesh.offset.offset_surface import onto_level
from pentapod.mesh.passes import Passes
from pentapod.mesh.query.tree import FacetTree
from pentapod.toolpath.surfaces.places import PlaceOptions, Places

CANCELLED = 1e-6
"""Share of its length, were all normals alike, up to which a sum of normals has no direction."""


@dataclass(frozen=True, eq=False)
class BallCentres(Places):
    """Where the centre of a ball of `radius` metres may be, over the facets of a tree."""

    tree: FacetTree
    radius: float
    options: PlaceOptions

    def settled(self, points: Floats, towards: Floats) -> tuple[Floats, Bools]:
        """Return points (N, 3) moved onto the offset, and which of them are on it then."""
        del towards
        off = self.options.on_level
        points, gaps = onto_level(self.tree, points, self.radius, self.options.rounds, off)
        return points, np.abs(gaps - self.radius) <= off * self.radius

    def on_level(self, points: Floats) -> Floats:
        """Return points (N, 3) moved onto the offset, as far as that is possible: see `onto_level`."""
        return self.settled(points, points)[0]

    def raised(self, points: Floats) -> Floats:
        """Return points (N, 3), those that are too near to the part moved onto the surface."""
        low = self.tree.closest(points, self.radius)[2] >= 0
        points = points.copy()
        points[low] = self.on_level(points[low])
        return points

    def near(self, points: Floats, towards: Floats, chordal: float) -> Bools:
        """Return which points (N, 3) are at most a radius and `chordal` metres from the part."""
        del towards
        return self.tree.within(points, self.radius + chordal)

    def normals(self, points: Floats) -> Floats:
        """Return unit normals (N, 3) of the offset at points on it: away from the part's closest points."""
        return normalised(self.tree.closest(points)[1])

    def midway(self, passes: Passes) -> Passes:
        """Return passes with normals midway between the two sides that the ball touches where they lead along a corner.

        One of the two is as near as the other there: which one is found changes from point to point. Where a pass only
        crosses a corner, its normals stay.
        """
        if not len(passes):
            return passes
        side = unit_or_zero(np.cross(self._along(passes), passes.normals)) * self.options.side * self.radius
        left, right = self.normals(passes.points - side), self.normals(passes.points + side)
        cosine = np.einsum("ni,ni->n", left, right)
        corner = (cosine < np.cos(self.options.corner)) & (cosine > -np.cos(self.options.corner))
        place = places(passes)[0]
        for a, b in marked_runs(corner).tolist():
            corner[a:b] = place[b - 1] - place[a] > 0.5 * self.options.window * self.radius
        return replace(passes, normals=np.where(corner[:, None], unit_or_zero(left + right), passes.normals))

    def _along(self, passes: Passes) -> Floats:
        """Return the direction (N, 3) of passes at their points, over half a window."""
        place, first, last = places(passes)
        half = 0.25 * self.options.window * self.radius
        ahead, back = np.minimum(place + half, last), np.maximum(place - half, first)
        return np.stack([np.interp(ahead, place, p) - np.interp(back, place, p) for p in passes.points.T], axis=1)

    def clear(self, starts: Floats, ends: Floats, chordal: float) -> Bools:
        """Return which chords (M,) are nowhere nearer to the part than the radius less `chordal` metres."""
        return self.tree.clear(starts, ends, self.radius - chordal)


def places(passes: Passes) -> tuple[Floats, Floats, Floats]:
    """Return how far along all passes each point is (N,), metres, and where its pass begins and ends."""
    place = np.concatenate([[0.0], np.cumsum(np.where(passes.within, passes.steps, 0.0))])
    owner = passes.pass_of_point
    return place, place[passes.starts[:-1]][owner], place[passes.starts[1:] - 1][owner]


def smoothed(passes: Passes, window: float) -> Floats:
    """Return unit normals (N, 3) of passes, averaged along each over `window` metres, less near its ends.

    Between walls that face each other they may cancel: there they stay.
    """
    place, first, last = places(passes)
    half = np.minimum(0.5 * window, np.minimum(place - first, last - place))
    middles = 0.5 * (passes.normals[1:] + passes.normals[:-1]) * passes.steps[:, None]
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(middles, axis=0)])
    total = np.stack(
        [np.interp(place + half, place, sums[:, k]) - np.interp(place - half, place, sums[:, k]) for k in range(3)],
        axis=1,
    )
    known = row_lengths(total) > CANCELLED * half
    return normalised(np.where(known[:, None], total, passes.normals))
