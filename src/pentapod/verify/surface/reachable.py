"""Reachability of points of the part for a cutter, without gouging.

A cutter can clear a point if it can contain the point, stay out of the part, and be retracted straight along the view.
For a ball only its centre counts: at least a radius from the part, at most a radius from the point. Such a centre is
searched for by alternating projections. Other cutters are tried in a few positions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.geometry.directions import normalised, tangent_frame
from pentapod.geometry.solids import Solid
from pentapod.mesh.query.distance import MeshDistance
from pentapod.mesh.query.swept_depth import TouchingBody, sweep, touch


@dataclass(frozen=True)
class ReachOptions:
    """Options of the searches.

    projections: at most so many alternating projections for each start; slack_m: their tolerance. around: directions
    about the normal, or about the axis, that are tried. places: positions on the end of the cutter that are tried, as
    shares of its flat part and of its rounding. depth_m: depth of a cutter that is not a ball that counts as none, as
    its sweep is not exact.
    """

    projections: int = 24
    slack_m: float = 1e-6
    around: int = 8
    places: tuple[tuple[float, float], ...] = ((0.0, 0.0), (1.0, 0.0), (1.0, 0.6), (1.0, 0.9), (0.5, 0.0))
    depth_m: float = 2e-5


def ball_reaches(
    surface: MeshDistance,
    points: Floats,
    normals: Floats,
    radius: float,
    view: Floats,
    options: ReachOptions = ReachOptions(),
) -> Bools:
    """Return which points (N, 3) a ball can contain without gouging the part, and be retracted along `view` from there.

    normals (N, 3): unit, of the surface below each point; the search starts along them.
    """
    slack = options.slack_m
    reached = np.zeros(len(points), dtype=np.bool_)
    for start in _starts(normals, view, options.around):
        open_ = np.flatnonzero(~reached)
        if not len(open_):
            break
        x, c = points[open_], points[open_] + radius * start[open_]
        todo = np.arange(len(x))
        for _ in range(options.projections):
            gap = surface.points(c[todo], within=radius)
            short, offset = radius - gap.distance, c[todo] - x[todo]
            far = (short > slack) | (np.linalg.norm(offset, axis=1) > radius + slack)
            todo, offset = todo[far], offset[far] + np.maximum(short, 0.0)[far, None] * gap.normal[far]
            if not len(todo):
                break
            off = np.linalg.norm(offset, axis=1, keepdims=True)
            c[todo] = x[todo] + np.where(off > radius, radius / np.maximum(off, 1e-300), 1.0) * offset
        held = surface.points(c, within=radius).distance >= radius - slack
        held &= np.linalg.norm(c - x, axis=1) <= radius + slack
        kept = np.flatnonzero(held)
        if len(kept):
            out = c[kept] + _way_out(surface, radius) * view
            free = surface.segments(c[kept], out, within=radius).distance >= radius - 2.0 * slack
            reached[open_[kept[free]]] = True
    return reached


def body_reaches(
    surface: MeshDistance,
    solids: tuple[Solid, ...],
    points: Floats,
    axes: Floats,
    normals: Floats,
    options: ReachOptions = ReachOptions(),
) -> Bools:
    """Return which points (N, 3) the end of a cutter can contain without gouging, and be retracted along its axis.

    axes (N, 3): unit, of the tool; normals (N, 3): of the surface below. A few positions on the end are tried.
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
    for share, up in options.places:
        # On the rounding, at a share `up` of its width, the end is higher than at its bottom.
        aside_by, drop = share * end.low_radius + up * end.rounding, end.rounding * (1.0 - np.sqrt(1.0 - up**2))
        for k, aside in enumerate(turns[: 1 if share == 0.0 else None]):
            open_ = np.flatnonzero(~reached)
            if not len(open_):
                return reached
            tips = points[open_] + aside_by * aside[open_] - drop * axes[open_]
            if k == 0 and (share, up) == (1.0, 0.0):
                tips += corner[open_]  # so that the rounding touches where the tool leans
            both = np.stack([tips, tips + length * axes[open_]], axis=1)
            free = ~touch(surface.tree, body, tips, axes[open_], threshold=options.depth_m).beyond(options.depth_m)
            open_, both = open_[free], both[free].reshape(-1, 3)
            if len(open_):
                axis = np.repeat(axes[open_], 2, axis=0)
                out = sweep(surface.tree, body, both, axis, threshold=options.depth_m, every=2)
                reached[open_[~out.beyond(options.depth_m)]] = True
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
