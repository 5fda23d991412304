"""Places of the tip of a bull-nose or flat end with a fixed axis: put exactly where a dropped cutter comes to rest.

On upright walls, where that height jumps, places are put beside the wall. Chords are proven by the depth of the part in
the cutter as it sweeps them, with a shank as wide as itself above it, however high.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.geometry.solids import Solid
from pentapod.mesh.normals import unit_or_zero
from pentapod.mesh.offset.tip_surface import Lowered
from pentapod.mesh.query.swept_depth import TouchingBody, meets
from pentapod.toolpath.surfaces.places import PlaceOptions, Places

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class TipPlaces(Places):
    """Where the tip of a cutter may be. lowered: the cutter and the part in the frame whose z axis is the tool's.

    frame (3, 3): its axes, in rows. radius: of the cutter, metres.
    """

    lowered: Lowered
    frame: Floats
    radius: float
    options: PlaceOptions

    @property
    def axis(self) -> Floats:
        """The tool's axis (3,), unit."""
        return self.frame[2]

    def settled(self, points: Floats, towards: Floats) -> tuple[Floats, Bools]:
        """Return points (N, 3) moved onto the surface along `towards` (N, 3), and which of them are on it then."""
        return self._settled(points @ self.frame.T, towards @ self.frame.T, self.options.reach)

    def _settled(self, local: Floats, towards: Floats, reach: float) -> tuple[Floats, Bools]:
        """Return `settled` of points and directions in the tool's frame. reach: in radii of the cutter."""
        ways = unit_or_zero(towards)
        ways = np.where(np.any(ways != 0.0, axis=1, keepdims=True), ways, UP)
        off = self.options.on_level * self.radius
        points, held = self.lowered.settled(local, ways, reach * self.radius, off)
        return points @ self.frame, held

    def on_level(self, points: Floats) -> Floats:
        """Return points (N, 3), those that are not clear moved onto the surface: see `raised`."""
        return self.raised(points)

    def raised(self, points: Floats) -> Floats:
        """Return points (N, 3), those that are not clear moved onto the surface: upwards, or aside if that is nearer.

        Aside is away from what would hold the cutter up.
        """
        local, points = points @ self.frame.T, points.copy()
        rows = np.flatnonzero(self.lowered.meets(local))
        local = local[rows]
        above = np.column_stack([local[:, :2], self.lowered.heights(local[:, :2])[0]])
        away = (local - self.lowered.touched(local[:, :2])) * [1.0, 1.0, 0.0]
        aside, held = self._settled(local, away, self.options.aside)
        nearer = held & (np.linalg.norm(aside - points[rows], axis=1) < above[:, 2] - local[:, 2])
        points[rows] = np.where(nearer[:, None], aside, above @ self.frame)
        return points

    def clear(self, starts: Floats, ends: Floats, chordal: float) -> Bools:
        """Return on which chords (M,) the part gets into the cutter by no more than `chordal` metres."""
        lowered = self.lowered
        high = 2.0 * float(np.ptp(lowered.tree.extents[0], axis=0).max()) + self.radius
        body = TouchingBody((Solid("cutter", lowered.radius, high, lowered.disc, lowered.disc, lowered.radius),))
        tips = np.stack([starts @ self.frame.T, ends @ self.frame.T], axis=1).reshape(-1, 3)
        return ~meets(lowered.tree, body, tips, np.tile(UP, (len(tips), 1)), threshold=chordal, every=2)

    def near(self, points: Floats, towards: Floats, chordal: float) -> Bools:
        """Return which points (N, 3) are at most `chordal` metres off the surface, along the normals `towards`."""
        ways = unit_or_zero(towards)
        ways = np.where(np.any(ways != 0.0, axis=1, keepdims=True), ways, self.axis)
        return self.lowered.meets((points - chordal * ways) @ self.frame.T)

    def normals(self, points: Floats) -> Floats:
        """Return the axis (N, 3): the tip is the contact of a cutter that stands on the surface."""
        return np.tile(self.axis, (len(points), 1))
