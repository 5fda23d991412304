"""Deepest point of one facet in a solid of revolution at rest; compiled.

f, the signed distance of a point from the solid, is convex. So it is lowest on the facet either where it is lowest on
the whole plane of the facet, if the facet holds such a point, or on a side of the facet. The first are points of the
plane that are nearest to the solid: one, the line beside a cylinder, or the disc below a flat end. Where the plane cuts
the solid and the facet does not, f is lowest on a side, too. Along a side two tangents bound f from below.
"""

from __future__ import annotations

import math

from pentapod.base.arrays import Floats
from pentapod.mesh.query.kernels.body_kernels import meridian_distance
from pentapod.numerics.kernels import kernel

STEPS = 24
"""Times that are tried at most along a side of a facet."""

LEAST_STEP = 0.05
"""Share of what is left of a side by which each step shortens that at least."""

ALIKE = 1e-9
"""Metres by which two supports of a solid differ at least, so that one of them is its nearest point to a plane."""

ALL, CUT = 7, 8
"""Beyond all sides of a facet; and what is not told by its sides, since the solid may cut it."""


@kernel
def into_frame(motion: Floats, corners: Floats, own: Floats) -> None:
    """Write the corners (3, 3) of a facet into own (3, 3), in the frame of a solid at rest: its tip and its axis, z."""
    up, aside = motion[3:6], motion[9:12]
    for k in range(3):
        x, y, z = corners[k, 0] - motion[0], corners[k, 1] - motion[1], corners[k, 2] - motion[2]
        own[k, 0] = x * aside[0] + y * aside[1] + z * aside[2]
        own[k, 1] = (
            x * (up[1] * aside[2] - up[2] * aside[1])
            + y * (up[2] * aside[0] - up[0] * aside[2])
            + z * (up[0] * aside[1] - up[1] * aside[0])
        )
        own[k, 2] = x * up[0] + y * up[1] + z * up[2] + motion[17]


@kernel
def _nearest_to_axis(own: Floats, lowest: Floats) -> float:
    """Write into lowest (4,), from index 1, the weights of the facet's nearest point to the axis; return how far it is.

    own (3, 3): corners in the frame of the solid.
    """
    inwards = 0
    for k in range(3):
        a, b = own[k], own[(k + 1) % 3]
        turn = a[0] * b[1] - a[1] * b[0]
        lowest[1 + (k + 2) % 3] = turn
        inwards += 1 if turn > 0.0 else -1 if turn < 0.0 else 0
    if abs(inwards) == 3:
        total = lowest[1] + lowest[2] + lowest[3]
        for k in range(3):
            lowest[1 + k] /= total
        return 0.0
    best, at, share = math.inf, 0, 0.0
    for k in range(3):
        a, b = own[k], own[(k + 1) % 3]
        dx, dy = b[0] - a[0], b[1] - a[1]
        square = dx * dx + dy * dy
        t = min(max(-(a[0] * dx + a[1] * dy) / square, 0.0), 1.0) if square > 0.0 else 0.0
        off = (a[0] + t * dx) ** 2 + (a[1] + t * dy) ** 2
        if off < best:
            best, at, share = off, k, t
    lowest[1 + at], lowest[1 + (at + 1) % 3], lowest[1 + (at + 2) % 3] = 1.0 - share, share, 0.0
    return math.sqrt(best)


@kernel
def _lower(solid: Floats, own: Floats, a: float, b: float, c: float, lowest: Floats) -> None:
    """Lower what was found in lowest (4,) to f at the weights a, b, c of a facet's corners, and to these weights."""
    x = a * own[0, 0] + b * own[1, 0] + c * own[2, 0]
    y = a * own[0, 1] + b * own[1, 1] + c * own[2, 1]
    z = a * own[0, 2] + b * own[1, 2] + c * own[2, 2]
    f = meridian_distance(solid, math.sqrt(x * x + y * y), z)[0]
    if f < lowest[0]:
        lowest[0], lowest[1], lowest[2], lowest[3] = f, a, b, c


@kernel
def told_at_once(solid: Floats, own: Floats, lowest: Floats) -> float:
    """Return a lower bound of f on a facet (3, 3) in the solid's frame: by its nearest point to the axis, and heights.

    lowest (4,): filled with the lower f of that point and of the highest and lowest corners, and weights of corners.
    """
    off = _nearest_to_axis(own, lowest)
    lowest[0] = math.inf
    _lower(solid, own, lowest[1], lowest[2], lowest[3], lowest)
    top = max(own[0, 2], own[1, 2], own[2, 2])
    bottom = min(own[0, 2], own[1, 2], own[2, 2])
    for k in range(3):
        if own[k, 2] == top or own[k, 2] == bottom:
            _lower(solid, own, 1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2), lowest)
    return max(off - max(solid[2], solid[3]), solid[0] - top, bottom - solid[1]) - solid[4]


@kernel
def lowest_on_facet(solid: Floats, own: Floats, lowest: Floats, enough: float, eps: float) -> float:
    """Return a lower bound of f on a facet (3, 3) in the solid's frame; lower what was found in lowest (4,).

    enough: the search ends with a bound that is not below it; eps: or with one that is so near to what was found.
    """
    bound, beyond = _nearest_on_plane(solid, own, lowest)
    if bound >= enough or bound >= lowest[0] - eps:
        return bound
    on_sides = math.inf
    for k in range(3):
        if beyond == CUT or beyond & (1 << k):
            on_sides = min(on_sides, _lowest_on_side(solid, own, (k + 1) % 3, (k + 2) % 3, lowest, enough, eps))
    if beyond == CUT or (bound <= 0.0 and on_sides < ALIKE):
        return max(bound, _below_tangent_plane(solid, own, lowest))
    return max(bound, on_sides)


@kernel
def _nearest_on_plane(solid: Floats, own: Floats, lowest: Floats) -> tuple[float, int]:
    """Return a lower bound of f on the plane of a facet, and beyond which sides of it the plane's lowest points lie.

    Such a point is lowest's where the facet holds one. Side k is opposite corner k and counts 2**k.
    """
    ux, uy, uz = own[1, 0] - own[0, 0], own[1, 1] - own[0, 1], own[1, 2] - own[0, 2]
    vx, vy, vz = own[2, 0] - own[0, 0], own[2, 1] - own[0, 1], own[2, 2] - own[0, 2]
    cx, cy, cz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    size = math.sqrt(cx * cx + cy * cy + cz * cz)
    if size == 0.0:
        return -math.inf, CUT
    nx, ny, nz = cx / size, cy / size, cz / size
    if nx * own[0, 0] + ny * own[0, 1] + nz * (own[0, 2] - 0.5 * (solid[0] + solid[1])) < 0.0:
        nx, ny, nz = -nx, -ny, -nz  # it leads from the solid to the facet
    off = math.inf
    for k in range(3):  # the normal of a thin facet is known less exactly
        off = min(off, nx * own[k, 0] + ny * own[k, 1] + nz * own[k, 2])
    out = math.sqrt(nx * nx + ny * ny)
    low, high = solid[2] * out + solid[0] * nz, solid[3] * out + solid[1] * nz
    bound = off - max(low, high) - solid[4]
    radius, height = (solid[3], solid[1]) if high > low else (solid[2], solid[0])
    away, flat = bound + solid[4], radius * out < ALIKE < radius
    kx, ky = (nx / out, ny / out) if out > 0.0 else (0.0, 0.0)
    if bound <= 0.0:
        # The line from the highest point of the solid over the plane to its lowest one cuts the plane within the solid.
        bottom, top = solid[0] * nz - solid[2] * out, solid[1] * nz - solid[3] * out
        under, foot = (solid[3], solid[1]) if top < bottom else (solid[2], solid[0])
        share = -bound / (max(low, high) - min(bottom, top) + 2.0 * solid[4])
        across = (1.0 - share) * radius - share * under
        off_axis, up = (1.0 - 2.0 * share) * solid[4], (1.0 - share) * height + share * foot
        a, b = _weights(own, across * kx + off_axis * nx, across * ky + off_axis * ny, up + off_axis * nz)
        return bound, ALL if a < 0.0 or b < 0.0 or a + b > 1.0 else CUT  # also where they are no numbers
    if flat:  # a point that is nearest to the axis would be as near, and was looked at
        return bound, ALL
    a, b = _weights(own, radius * kx + away * nx, radius * ky + away * ny, height + away * nz)
    if abs(high - low) < ALIKE:  # all of the line to the other end of the side is as near
        radius, height = (solid[2], solid[0]) if high > low else (solid[3], solid[1])
        c, d = _weights(own, radius * kx + away * nx, radius * ky + away * ny, height + away * nz)
        first, last = 0.0, 1.0
        for here, there in ((a, c), (b, d), (1.0 - a - b, 1.0 - c - d)):
            if here < 0.0 or there < 0.0:
                at = here / (here - there) if here != there else math.inf
                first, last = (max(first, at), last) if here < 0.0 else (first, min(last, at))
        if not first <= last:
            return bound, ALL
        middle = 0.5 * (first + last)
        a, b = a + middle * (c - a), b + middle * (d - b)
    beyond = (1 if a + b > 1.0 else 0) | (2 if a < 0.0 else 0) | (4 if b < 0.0 else 0)
    if beyond == 0:
        _lower(solid, own, 1.0 - a - b, a, b, lowest)
    return bound, beyond


@kernel
def _weights(own: Floats, x: float, y: float, z: float) -> tuple[float, float]:
    """Return the weights of the second and third corner of a facet at a point in its plane."""
    ux, uy, uz = own[1, 0] - own[0, 0], own[1, 1] - own[0, 1], own[1, 2] - own[0, 2]
    vx, vy, vz = own[2, 0] - own[0, 0], own[2, 1] - own[0, 1], own[2, 2] - own[0, 2]
    cx, cy, cz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    square = cx * cx + cy * cy + cz * cz
    x, y, z = x - own[0, 0], y - own[0, 1], z - own[0, 2]
    a = (cx * (y * vz - z * vy) + cy * (z * vx - x * vz) + cz * (x * vy - y * vx)) / square
    b = (cx * (uy * z - uz * y) + cy * (uz * x - ux * z) + cz * (ux * y - uy * x)) / square
    return a, b


@kernel
def _lowest_on_side(solid: Floats, own: Floats, i: int, j: int, lowest: Floats, enough: float, eps: float) -> float:
    """Return a lower bound of f on the side from corner i to corner j of a facet. As `lowest_on_facet`."""
    start, late = 0.0, 1.0
    before, falls = _along_side(solid, own, i, j, start, lowest)
    after, rises = _along_side(solid, own, i, j, late, lowest)
    if falls >= 0.0:
        return before
    if rises <= 0.0:
        return after
    bound = -math.inf
    for _ in range(STEPS):
        at = (before - after + rises * late - falls * start) / (rises - falls)
        bound = before + falls * (at - start)
        if bound >= enough or bound >= lowest[0] - eps:
            break
        least = LEAST_STEP * (late - start)
        at = min(max(at, start + least), late - least)
        value, slope = _along_side(solid, own, i, j, at, lowest)
        if slope < 0.0:
            start, before, falls = at, value, slope
        else:
            late, after, rises = at, value, slope
    return bound


@kernel
def _along_side(solid: Floats, own: Floats, i: int, j: int, t: float, lowest: Floats) -> tuple[float, float]:
    """Return f and its slope at a share t of the side from corner i to corner j; lower what was found in lowest."""
    dx, dy, dz = own[j, 0] - own[i, 0], own[j, 1] - own[i, 1], own[j, 2] - own[i, 2]
    x, y = own[i, 0] + t * dx, own[i, 1] + t * dy
    r = math.sqrt(x * x + y * y)
    f, by_r, by_z = meridian_distance(solid, r, own[i, 2] + t * dz)
    if f < lowest[0]:
        lowest[0], lowest[1], lowest[2], lowest[3] = f, 0.0, 0.0, 0.0
        lowest[1 + i], lowest[1 + j] = 1.0 - t, t
    return f, (by_r * (x * dx + y * dy) / r if r > 1e-15 else 0.0) + by_z * dz


@kernel
def _below_tangent_plane(solid: Floats, own: Floats, lowest: Floats) -> float:
    """Return the lower bound of f on a facet that its tangent plane at the lowest point gives that was found."""
    a, b, c = lowest[1], lowest[2], lowest[3]
    x = a * own[0, 0] + b * own[1, 0] + c * own[2, 0]
    y = a * own[0, 1] + b * own[1, 1] + c * own[2, 1]
    z = a * own[0, 2] + b * own[1, 2] + c * own[2, 2]
    r = math.sqrt(x * x + y * y)
    f, by_r, by_z = meridian_distance(solid, r, z)
    scale, fall = (by_r / r if r > 1e-15 else 0.0), 0.0
    for k in range(3):
        fall = min(fall, scale * (x * (own[k, 0] - x) + y * (own[k, 1] - y)) + by_z * (own[k, 2] - z))
    return f + fall
