"""Points on the surface of the places to which a cutter of fixed axis can be lowered: on lines, by drop heights."""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.mesh.offset.drop_kernels import drop
from pentapod.mesh.query.kernels.segment_kernels import STACK
from pentapod.numerics.kernels import kernel

_FLAT = 0.7
"""Upward part of a direction from which on a point is first looked for above or below itself."""


@kernel
def _normal(height: float, z: float, x: float, y: float, tie: float, touch: Floats, normal: Floats) -> None:
    """Fill the normal (3,) at a place at height z by what holds the cutter at `height` there: at jumps it is level."""
    ux, uy = x - touch[0], y - touch[1]
    aside = math.sqrt(ux * ux + uy * uy)
    sine = 1.0 if height > z + tie else touch[3]
    if aside == 0.0:
        sine = 0.0
        aside = 1.0
    normal[0], normal[1] = sine * ux / aside, sine * uy / aside
    normal[2] = math.sqrt(max(1.0 - sine * sine, 0.0))


@kernel
def cross_tips(
    starts: Floats, axes: Ints, lengths: Floats, rounds: int, radius: float, disc: float, corners: Floats,
    leaf_starts: Ints, extents: Floats, points: Floats, normals: Floats,
) -> None:  # fmt: skip
    """Fill where (E, 3) level lines from starts (E, 3) along axes (E,) leave what the cutter cannot reach, and normals.

    lengths (E,): metres, of the lines; negative ones run backwards. At its start a line is below the disc's height, at
    its end above. rounds: of halving.
    """
    nodes, bounds, touch = np.empty(STACK, dtype=np.intp), np.empty(STACK), np.empty(4)
    p = np.empty(3)
    for m in range(len(starts)):
        p[:] = starts[m]
        axis, low, high = axes[m], 0.0, lengths[m]
        for _ in range(rounds):
            middle = 0.5 * (low + high)
            p[axis] = starts[m, axis] + middle
            met = drop(p[0], p[1], radius, disc, p[2], True, corners, leaf_starts, extents, nodes, bounds, touch)
            if met > p[2]:
                low = middle
            else:
                high = middle
        p[axis] = starts[m, axis] + low
        points[m] = p
        height = drop(p[0], p[1], radius, disc, p[2], False, corners, leaf_starts, extents, nodes, bounds, touch)
        # A slope of 1,000 over what is left of the line is a jump.
        _normal(height, p[2], p[0], p[1], 1e3 * abs(high - low), touch, normals[m])


@kernel
def drop_normals(places: Floats, heights: Floats, touches: Floats, normals: Floats) -> None:
    """Fill normals (N, 3) where cutters at places (N, 2) rest at heights (N,). touches (N, 4): of `drop_all`."""
    for m in range(len(places)):
        _normal(heights[m], heights[m], places[m, 0], places[m, 1], 0.0, touches[m], normals[m])


@kernel
def settle(
    points: Floats, towards: Floats, reach: float, accuracy: float, radius: float, disc: float, corners: Floats,
    leaf_starts: Ints, extents: Floats, held: Ints,
) -> None:  # fmt: skip
    """Move points (N, 3) along `towards` (N, 3), or back, to where the disc of the cutter is just clear.

    reach, accuracy: metres, of the way and of its end. Where the direction leads up, points move upright if that is no
    farther. held (N,): 1 where such a place was found, 0 where not; there the points stay.
    """
    nodes, bounds, touch = np.empty(STACK, dtype=np.intp), np.empty(STACK), np.empty(4)
    for m in range(len(points)):
        x, y, z = points[m, 0], points[m, 1], points[m, 2]
        dx, dy, dz = towards[m, 0], towards[m, 1], towards[m, 2]
        held[m] = 1
        if dz > _FLAT:
            height = drop(x, y, radius, disc, -math.inf, False, corners, leaf_starts, extents, nodes, bounds, touch)
            if abs(height - z) <= reach:
                points[m, 2] = height
                continue
        blocked = drop(x, y, radius, disc, z, True, corners, leaf_starts, extents, nodes, bounds, touch) > z
        # Out of what the cutter cannot reach, or towards it, in steps that grow.
        sense = 1.0 if blocked else -1.0
        near, far, step, found = 0.0, 0.0, 2.0 * accuracy, False
        while abs(far) < reach:
            far = sense * min(abs(near) + step, reach)
            ex, ey, ez = x + far * dx, y + far * dy, z + far * dz
            met = drop(ex, ey, radius, disc, ez, True, corners, leaf_starts, extents, nodes, bounds, touch) > ez
            if met != blocked:
                found = True
                break
            near, step = far, 4.0 * step
        if not found:
            held[m] = 0
            continue
        clear, closed = (far, near) if blocked else (near, far)
        while abs(clear - closed) > accuracy:
            middle = 0.5 * (clear + closed)
            ex, ey, ez = x + middle * dx, y + middle * dy, z + middle * dz
            if drop(ex, ey, radius, disc, ez, True, corners, leaf_starts, extents, nodes, bounds, touch) > ez:
                closed = middle
            else:
                clear = middle
        points[m, 0], points[m, 1], points[m, 2] = x + clear * dx, y + clear * dy, z + clear * dz


@kernel
def all_met(
    points: Floats, radius: float, disc: float, corners: Floats, leaf_starts: Ints, extents: Floats, met: Ints
) -> None:
    """Fill met (N,): 1 where the disc at a point (N, 3) is below the height to which it can be lowered there."""
    nodes, bounds, touch = np.empty(STACK, dtype=np.intp), np.empty(STACK), np.empty(4)
    for m in range(len(points)):
        x, y, z = points[m, 0], points[m, 1], points[m, 2]
        met[m] = drop(x, y, radius, disc, z, True, corners, leaf_starts, extents, nodes, bounds, touch) > z
