"""Reachability of points of the part for a cutter, without gouging.

A cutter can clear a point if it can contain the point, stay out of the part, and be retracted straight along the view.
For a ball only its centre counts: at least a radius from the part, at most a radius from the point. Such a centre is
searched for by alternating projections; for a point that the ball cannot contain, the nearest one, by halving the
distance. Other cutters are tried in a few positions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.geometry.directions import normalised, tangent_frame
from pentapod.geometry.solids import Solid
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import MeshDistance
from pentapod.mesh.query.heightfield import HeightField
from pentapod.mesh.query.swept_depth import TouchingBody, meets


@dataclass(frozen=True)
class ReachOptions:
    """Options of the searches.

    projections: at most so many alternating projections for each start; slack_m: their tolerance. around: directions
    about the normal, or about the axis, that are tried. places: positions on the end of the cutter that are tried, as
    shares of its flat part and of its rounding. depth_m: depth of a cutter that is not a ball that counts as none, as
    its sweep is not exact. halvings, near_m: of the distance of the nearest centre, and how near to it is enough.
    above_m: height of the points whose view is tested. leans: directions of a leaning tool that are tried; slack_m of a
    ray counts as none.
    """

    projections: int = 24
    slack_m: float = 1e-6
    around: int = 8
    places: tuple[tuple[float, float], ...] = ((0.0, 0.0), (1.0, 0.0), (1.0, 0.6), (1.0, 0.9), (0.5, 0.0))
    depth_m: float = 2e-5
    halvings: int = 14
    near_m: float = 5e-6
    above_m: float = 1e-5
    leans: int = 72


def open_to_leans(
    mesh: Mesh, points: Floats, view: Floats, most: float, options: ReachOptions = ReachOptions()
) -> Bools:
    """Return from which points (N, 3) a line leads out of the part, at most `most` radians from the view.

    A ball with a stem as wide as itself that holds a point also holds, with its stem, the line from the point along its
    axis. So no lean of such a tool reaches a point from which all these lines meet the part.
    """
    free = np.zeros(len(points), dtype=np.bool_)
    first, second = tangent_frame(view)
    # A spiral with even area on the cap.
    height = 1.0 - (np.arange(options.leans) + 0.5) / options.leans * (1.0 - np.cos(most))
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(options.leans)
    for up, angle in zip(height.tolist(), turn.tolist(), strict=True):
        rows = np.flatnonzero(~free)
        if not len(rows):
            break
        lean = up * view + np.sqrt(1.0 - up**2) * (np.cos(angle) * first + np.sin(angle) * second)
        free[rows] = ~HeightField(mesh, lean).hides(points[rows], options.slack_m)
    return free


def nearest_centres(
    surface: MeshDistance,
    points: Floats,
    normals: Floats,
    radius: float,
    view: Floats,
    beyond: Floats,
    options: ReachOptions = ReachOptions(),
    *,
    retracted: bool = True,
) -> Floats:
    """Return the centres (N, 3) nearest to points (N, 3) at which a ball gouges nowhere and can be retracted.

    The nearest that a search finds, NaN where it finds none. normals (N, 3): unit, of the surface below; the search
    starts along them. beyond (k ≥ 2,): ascending from 0, metres by which a first centre may be farther than a radius.
    retracted: False for centres that need not be retracted, such as those under an overhang.
    """
    centres, low = np.full(points.shape, np.nan), np.zeros(len(points))
    field, out = HeightField(surface.mesh, view), view if retracted else None
    for height in beyond:
        open_ = np.flatnonzero(np.isnan(centres[:, 0]))
        # A ball that is retracted along the view sweeps a convex room: from each of its points the view is free. What
        # is hidden even at the first height is out of reach, and does not answer for what hides it.
        if retracted:
            at = points[open_] + (min(height, float(beyond[1])) + options.above_m) * normals[open_]
            open_ = open_[~field.hides(at, options.above_m)]
        for start in _starts(normals[open_], view, options.around)[: None if height > 0.0 else 1]:
            todo = np.isnan(centres[open_, 0])
            rows = open_[todo]
            if len(rows):
                within = np.full(len(rows), radius + height)
                first = points[rows] + (radius + height) * start[todo]
                centres[rows] = _settled(surface, points[rows], normals[rows], first, within, radius, out, options)
    high = np.linalg.norm(centres - points, axis=1) - radius
    for _ in range(options.halvings):
        open_ = np.flatnonzero(high - low > options.near_m)
        if not len(open_):
            break
        middle = 0.5 * (low[open_] + high[open_])
        within = radius + middle
        made = _settled(surface, points[open_], normals[open_], centres[open_], within, radius, out, options)
        better = ~np.isnan(made[:, 0])
        low[open_[~better]] = middle[~better]
        hit = open_[better]
        centres[hit] = made[better]
        high[hit] = np.minimum(np.linalg.norm(centres[hit] - points[hit], axis=1) - radius, middle[better])
    return centres


def _settled(
    surface: MeshDistance,
    points: Floats,
    normals: Floats,
    centres: Floats,
    within: Floats,
    radius: float,
    out: Floats | None,
    options: ReachOptions,
) -> Floats:
    """Return clear centres (N, 3) near the given ones, `within` (N,) metres of points (N, 3); NaN where none is found.

    From them the ball can be retracted along `out` (3,), if that is given. By alternating projections on what is a
    radius from the part and on what is within that distance of the point. The part must not be between: a ball behind a
    thin wall says nothing of this side.
    """
    slack, c = options.slack_m, centres.copy()
    todo = np.arange(len(c))
    for _ in range(options.projections):
        gap = surface.points(c[todo], within=radius)
        short, offset, most = radius - gap.distance, c[todo] - points[todo], within[todo]
        far = (short > slack) | (np.linalg.norm(offset, axis=1) > most + slack)
        todo, offset = todo[far], offset[far] + np.maximum(short, 0.0)[far, None] * gap.normal[far]
        if not len(todo):
            break
        off, most = np.linalg.norm(offset, axis=1, keepdims=True), most[far, None]
        c[todo] = points[todo] + np.where(off > most, most / np.maximum(off, 1e-300), 1.0) * offset
    held = surface.points(c, within=radius).distance >= radius - slack
    held &= np.linalg.norm(c - points, axis=1) <= within + slack
    kept = np.flatnonzero(held)
    if len(kept):
        if out is not None:
            ends = c[kept] + _way_out(surface, radius) * out
            held[kept] = surface.segments(c[kept], ends, within=radius).distance >= radius - 2.0 * slack
        way = c[kept] - points[kept]
        start = points[kept] + options.above_m * way / np.linalg.norm(way, axis=1, keepdims=True)
        held[kept] &= surface.segments(start, c[kept], within=slack).distance >= slack
        held[kept] &= np.einsum("ij,ij->i", way, normals[kept]) > 0.0
    return np.where(held[:, None], c, np.nan)


def body_reaches(
    surface: MeshDistance,
    solids: tuple[Solid, ...],
    points: Floats,
    axes: Floats,
    normals: Floats,
    lowest: float = -np.inf,
    options: ReachOptions = ReachOptions(),
) -> Bools:
    """Return which points (N, 3) the end of a cutter can contain without gouging, and be retracted along its axis.

    axes (N, 3): unit, of the tool; normals (N, 3): of the surface below. lowest: height along the axes, metres, below
    which the tip must not be. A few positions on the end are tried.
    """
    body = TouchingBody(solids)
    wide = max(solid.largest_radius for solid in solids)
    length = _way_out(surface, wide)
    reached = np.zeros(len(points), dtype=np.bool_)
    first, second = tangent_frame(axes)
    flat = normals - np.einsum("ij,ij->i", normals, axes)[:, None] * axes
    sine = np.linalg.norm(flat, axis=1, keepdims=True)
    lean = np.where(sine > 1e-6, flat / np.maximum(sine, 1e-300), first)
    end = min(solids, key=lambda solid: solid.low - solid.rounding)
    corner = end.rounding * (normals - axes)
    turns = [lean, *(np.cos(a) * first + np.sin(a) * second for a in _angles(options.around))]
    # On the rounding, at a share `up` of its width, the end is higher than at its bottom.
    places = [(share, np.full(len(points), up)) for share, up in options.places]
    if np.isfinite(lowest) and end.rounding > 0.0:
        stands = np.clip((np.einsum("ij,ij->i", points, axes) - lowest) / end.rounding, 0.0, 1.0)
        places.append((1.0, np.sqrt(1.0 - (1.0 - stands) ** 2)))  # the tip as low as it may be
    for share, up in places:
        aside_by = (share * end.low_radius + up * end.rounding)[:, None]
        drop = (end.rounding * (1.0 - np.sqrt(1.0 - up**2)))[:, None]
        for k, aside in enumerate(turns[: 1 if share == 0.0 else None]):
            open_ = np.flatnonzero(~reached)
            if not len(open_):
                return reached
            tips = points[open_] + aside_by[open_] * aside[open_] - drop[open_] * axes[open_]
            if k == 0 and share == 1.0 and not up.any():
                tips += corner[open_]  # so that the rounding touches where the tool leans
            high = np.einsum("ij,ij->i", tips, axes[open_]) >= lowest - options.slack_m
            open_, tips = open_[high], tips[high]
            for way in (0.0, length):  # first where it stands: that tells most of them quickly
                both = np.stack([tips, tips + way * axes[open_]], axis=1).reshape(-1, 3)
                turned = np.repeat(axes[open_], 2, axis=0)
                free = ~meets(surface.tree, body, both, turned, threshold=options.depth_m, every=2)
                open_, tips = open_[free], tips[free]
            reached[open_] = True
    return reached


def _angles(count: int) -> Floats:
    return 2.0 * np.pi * np.arange(count) / count


def _starts(normals: Floats, view: Floats, count: int) -> list[Floats]:
    """Return directions (N, 3) in which a search starts: the normals, the view, and `count` around the normals."""
    up = np.broadcast_to(view, normals.shape)
    between = normals + up
    first, second = tangent_frame(normals)
    around = [normalised(normals + np.cos(a) * first + np.sin(a) * second) for a in _angles(count)]
    return [normals, up, normalised(np.where(np.linalg.norm(between, axis=1)[:, None] > 1e-9, between, up)), *around]


def _way_out(surface: MeshDistance, wide: float) -> float:
    """Return the length of a retraction that clears all of the part, metres."""
    return float(np.linalg.norm(np.ptp(surface.bounds, axis=0))) + 4.0 * wide
