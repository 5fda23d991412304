"""Whether a cutter could clear a place at all: what its shape and the part's cannot let it reach, told apart.

A cutter can clear a point where it holds the point while it stays out of the part, and can be lifted straight out
along the view. For a ball that is a question about its centre alone: at least a radius from the part, at most a radius
from the point. Such a centre is looked for by going to and fro between the two; others are tried in a few places.
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.geometry.directions import normalised, tangent_frame
from pentapod.geometry.solids import Solid
from pentapod.mesh.query.distance import MeshDistance
from pentapod.mesh.query.swept_depth import TouchingBody, sweep, touch

_ROUNDS = 24
_SLACK_M = 1e-6
_AROUND = 8
_PLACES = ((0.0, 0.0), (1.0, 0.0), (1.0, 0.6), (1.0, 0.9), (0.5, 0.0))
"""Where on a cutter's end a point is taken to: shares of its flat part, and of its rounding."""
_TOUCH_M = 2e-5
"""Depth of a cutter that is not a ball that counts as none here: its sweep is not exact."""


def ball_reaches(surface: MeshDistance, points: Floats, normals: Floats, radius: float, view: Floats) -> Bools:
    """Return which points (N, 3) a ball can hold that stays out of the part and can leave along `view`.

    normals (N, 3): unit, of the surface below each point; where the search begins.
    """
    reached = np.zeros(len(points), dtype=np.bool_)
    for start in _starts(normals, view):
        open_ = np.flatnonzero(~reached)
        if not len(open_):
            break
        x, c = points[open_], points[open_] + radius * start[open_]
        todo = np.arange(len(x))
        for _ in range(_ROUNDS):
            gap = surface.points(c[todo], within=radius)
            short, way = radius - gap.distance, c[todo] - x[todo]
            far = (short > _SLACK_M) | (np.linalg.norm(way, axis=1) > radius + _SLACK_M)
            todo, way = todo[far], way[far] + np.maximum(short, 0.0)[far, None] * gap.normal[far]
            if not len(todo):
                break
            off = np.linalg.norm(way, axis=1, keepdims=True)
            c[todo] = x[todo] + np.where(off > radius, radius / np.maximum(off, 1e-300), 1.0) * way
        held = surface.points(c, within=radius).distance >= radius - _SLACK_M
        held &= np.linalg.norm(c - x, axis=1) <= radius + _SLACK_M
        kept = np.flatnonzero(held)
        if len(kept):
            out = c[kept] + _way_out(surface, radius) * view
            free = surface.segments(c[kept], out, within=radius).distance >= radius - 2.0 * _SLACK_M
            reached[open_[kept[free]]] = True
    return reached


def body_reaches(
    surface: MeshDistance, solids: tuple[Solid, ...], points: Floats, axes: Floats, normals: Floats
) -> Bools:
    """Return which points (N, 3) the end of a cutter can hold that stays out of the part and can leave along its axis.

    axes (N, 3): unit, of the tool; normals (N, 3): of the surface below. The point is taken to a few places of the end.
    """
    body = TouchingBody(solids)
    wide = max(max(s.low_radius, s.high_radius) + s.rounding for s in solids)
    length = _way_out(surface, wide)
    reached = np.zeros(len(points), dtype=np.bool_)
    first, second = tangent_frame(axes)
    flat = normals - np.einsum("ij,ij->i", normals, axes)[:, None] * axes
    sine = np.linalg.norm(flat, axis=1, keepdims=True)
    lean = np.where(sine > 1e-6, flat / np.maximum(sine, 1e-300), first)
    end = min(solids, key=lambda solid: solid.low - solid.rounding)
    corner = end.rounding * (normals - axes)
    turns = [lean, *(np.cos(a) * first + np.sin(a) * second for a in 2.0 * np.pi * np.arange(_AROUND) / _AROUND)]
    for share, up in _PLACES:
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
            stands = ~touch(surface.tree, body, tips, axes[open_], threshold=_TOUCH_M).beyond(_TOUCH_M)
            open_, both = open_[stands], both[stands].reshape(-1, 3)
            if len(open_):
                axis = np.repeat(axes[open_], 2, axis=0)
                out = sweep(surface.tree, body, both, axis, threshold=_TOUCH_M, every=2)
                reached[open_[~out.beyond(_TOUCH_M)]] = True
    return reached


def _starts(normals: Floats, view: Floats) -> list[Floats]:
    """Return directions (N, 3) in which to look first: along the normals, the view, and around the normals."""
    up = np.broadcast_to(view, normals.shape)
    between = normals + up
    first, second = tangent_frame(normals)
    turns = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    around = [normalised(normals + np.cos(a) * first + np.sin(a) * second) for a in turns]
    return [normals, up, normalised(np.where(np.linalg.norm(between, axis=1)[:, None] > 1e-9, between, up)), *around]


def _way_out(surface: MeshDistance, wide: float) -> float:
    """Return how far one must go to be clear of all of the part, metres."""
    return float(np.linalg.norm(np.ptp(surface.bounds, axis=0))) + 4.0 * wide
