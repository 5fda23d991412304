"""Limit surface: what the shape of the cutter leaves on a part, wherever the cutter goes.

It is the boundary of all the room that the cutter can clear without gouging. Where the cutter touches the part, it is
the part's surface; in a corner narrower than a ball it is the ball's own arc. What is left beyond it was left by the
motion. A point of the part that a ball cannot touch answers for the nearest point of the limit surface, which is on the
line to the nearest centre that the ball can have; along this line, which is the limit surface's normal, it is measured
what is left. So a ridge between passes counts in a corner as it counts on the part itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from pentapod.base.arrays import Bools, Floats
from pentapod.geometry.solids import Solid
from pentapod.mesh.query.heightfield import HeightField
from pentapod.numerics.threads import nearest_points
from pentapod.verify.replay.along_toolpath import Motion
from pentapod.verify.surface.reachable import body_reaches, nearest_centres
from pentapod.verify.verdict.coverage import Coverage
from pentapod.verify.verdict.cutting import Cutting

SAME_AXIS = 1e-12
"""1 less the cosine of two directions that are the same but for rounding."""


@dataclass(frozen=True)
class LimitOptions:
    """Options of the search for the limit surface.

    touches: height of the limit surface that counts as none, metres. far: radii of a ball up to which it is searched
    for. steps: heights at which cutters that are no balls are tried, up to what may be left. above_m: height of points
    whose view is tested, for a beam. hidden: share of what may be left by which an overhang must keep a ball off;
    hangs: metres from the part from which on a ball touches nothing.
    """

    touches: float = 1e-6
    far: float = 4.0
    steps: int = 8
    above_m: float = 1e-5
    hidden: float = 0.25
    hangs: float = 2e-5

    def first_heights(self, radius: float, coverage: Coverage) -> Floats:
        """Return heights (k,), metres, at which a ball is searched for one after the other."""
        far, first = self.far * radius, min(coverage.left, self.far * radius)
        return np.array([0.0, *(first * 2.0 ** np.arange(np.ceil(np.log2(far / first)))), far])


@dataclass(frozen=True, eq=False)
class LimitSurface:
    """The limit surface above points of the part, as far as a search finds it.

    heights (N,): distances from the points of the part, metres; 0 where the cutter touches the part, NaN where no room
    is found that it can clear. points (N, 3): of the limit surface; normals (N, 3): its own, unit.
    """

    heights: Floats
    points: Floats
    normals: Floats

    def where(self, keep: Bools) -> LimitSurface:
        """Return the limit surface above some of the points (N,)."""
        return LimitSurface(self.heights[keep], self.points[keep], self.normals[keep])

    @classmethod
    def above(
        cls,
        motion: Motion,
        coverage: Coverage,
        cutting: Cutting,
        points: Floats,
        normals: Floats,
        options: LimitOptions = LimitOptions(),
    ) -> LimitSurface:
        """Return the limit surface above points (N, 3) of the part with these normals."""
        if not len(points):
            return cls(np.zeros(0), points, normals)
        if not cutting.cutter:
            seen = _seen(coverage, cutting, points + options.above_m * normals, options.above_m)
            return cls(np.where(seen, 0.0, np.nan), points, normals)
        for solid in cutting.cutter:
            if is_ball_end(motion, solid):
                return cls._of_ball(cutting, coverage, points, normals, solid.rounding, options)
        return cls._of_body(motion, coverage, cutting, points, normals, options)

    @classmethod
    def _of_ball(
        cls,
        cutting: Cutting,
        coverage: Coverage,
        points: Floats,
        normals: Floats,
        radius: float,
        options: LimitOptions,
    ) -> LimitSurface:
        beyond = options.first_heights(radius, coverage)
        offset = nearest_centres(cutting.surface, points, normals, radius, coverage.up, beyond) - points
        away = np.linalg.norm(offset, axis=1)
        heights = np.where(away <= radius + options.touches, 0.0, away - radius)
        towards = np.where(heights[:, None] > 0.0, offset / away[:, None], normals)
        return cls(heights, points + heights[:, None] * towards, towards)

    @classmethod
    def _of_body(
        cls,
        motion: Motion,
        coverage: Coverage,
        cutting: Cutting,
        points: Floats,
        normals: Floats,
        options: LimitOptions,
    ) -> LimitSurface:
        """Return the limit surface of another cutter: the highest of a few heights that it cannot reach, or none.

        It stands as the program has it nearby, or along the normals, unless its axis must keep one direction: then its
        tip stays above the lowest point of the part, below which is what the part stands on. Nothing is known of its
        normals: those of the part stand for them.
        """
        axes = motion.axes[np.asarray(nearest_points(KDTree(motion.tilt_centres[:]), points)[1])]
        ways, lowest = (axes, normals), -np.inf
        if coverage.one_direction and _keeps_its_axis(motion):
            ways, lowest = (axes,), float((cutting.surface.mesh.vertices @ axes[0]).min())
        steps = np.linspace(0.0, coverage.left, options.steps + 1)
        heights = np.full(len(points), np.nan)
        for below, height in zip([0.0, *steps[:-1]], steps, strict=True):
            for along in ways:
                open_ = np.flatnonzero(np.isnan(heights))
                if len(open_):
                    at, up = points[open_] + height * normals[open_], normals[open_]
                    reached = body_reaches(cutting.surface, cutting.cutter, at, along[open_], up, lowest)
                    heights[open_[reached]] = below
        return cls(heights, points + heights[:, None] * normals, normals)


def under_overhangs(
    cutting: Cutting,
    coverage: Coverage,
    points: Floats,
    normals: Floats,
    limit: LimitSurface,
    options: LimitOptions = LimitOptions(),
) -> Bools:
    """Return which points (N, 3) only an overhang keeps a ball off, since it is retracted along the view.

    limit: the limit surface above them. The point is hidden from the view, or a ball at the nearest centre touches
    nothing; and if it had not to be retracted, it would come nearer by more than a share of what may be left.
    """
    field, radius = HeightField(cutting.surface.mesh, coverage.up), cutting.cutter[0].rounding
    found = field.hides(points + options.above_m * normals, options.above_m)
    within = radius + options.hangs
    found |= cutting.surface.points(limit.points + radius * limit.normals, within=within).distance >= within
    points, normals, heights = points[found], normals[found], limit.heights[found]
    beyond = options.first_heights(radius, coverage)
    centres = nearest_centres(cutting.surface, points, normals, radius, coverage.up, beyond, retracted=False)
    nearer = heights - (np.linalg.norm(centres - points, axis=1) - radius)
    found[found] = nearer > options.hidden * coverage.left
    return found


def is_ball_end(motion: Motion, solid: Solid) -> bool:
    """Return whether a solid is the ball about the tilt centre."""
    return solid.is_ball and solid.low == motion.toolpath.tilt_centre


def _keeps_its_axis(motion: Motion) -> bool:
    """Return whether the tool keeps one direction: the toolpath does, and the axis may not leave it."""
    own = motion.toolpath.axes
    return motion.specification.tilt == 0.0 and bool((own @ own[0] > 1.0 - SAME_AXIS).all())


def _seen(coverage: Coverage, cutting: Cutting, points: Floats, within: float) -> Bools:
    """Return which points (N, 3) the view sees: a beam along it reaches no others."""
    surface = cutting.surface
    size = float(np.linalg.norm(np.ptp(surface.bounds, axis=0)))
    return np.asarray(surface.segments(points, points + 2.0 * size * coverage.up, within=within).distance > 0.0)
