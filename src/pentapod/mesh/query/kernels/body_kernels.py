"""Signed distance of mesh points from a moving convex solid of revolution, with derivatives; compiled."""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.numerics.kernels import inlined_kernel, kernel

AXIS = 3
"""Index of the axis in a pose."""

VALUE, RATE, RADIUS = range(3, 6)
"""Indices of f, ∂f/∂t and W in what `derivatives` writes."""

NEAR_M = 2e-8
"""How near the plane of `lowest_on_way` comes to f, metres, unless that takes too many steps."""

ON_WAY = 24
"""Times that `lowest_on_way` tries at most."""

LEAST_STEP = 0.05
"""Share of what is left of the times by which each of its steps shortens that at least."""


@inlined_kernel
def meridian_distance(solid: Floats, r: float, z: float) -> tuple[float, float, float]:
    """Return the signed distance of (r, z), radius and height, from a solid (5,), and its derivatives by r and z."""
    low, high, low_radius, high_radius, rounding = solid[0], solid[1], solid[2], solid[3], solid[4]
    side_r, side_z = high_radius - low_radius, high - low
    length = math.sqrt(side_r * side_r + side_z * side_z)
    normal_r, normal_z = 1.0, 0.0
    if length > 0.0:
        normal_r, normal_z = side_z / length, -side_r / length
    beyond = (r - low_radius) * normal_r + (z - low) * normal_z
    if low <= z <= high and beyond <= 0.0:
        below, above = low - z, z - high
        if beyond >= below and beyond >= above:
            return beyond - rounding, normal_r, normal_z
        if below >= above:
            return below - rounding, 0.0, -1.0
        return above - rounding, 0.0, 1.0
    # Outside: the nearest point of the outline: lower disc, slanted side, or upper disc.
    near_r, near_z, onto_z = min(r, low_radius), low, -1.0
    best = (r - near_r) ** 2 + (z - near_z) ** 2
    other_r = min(r, high_radius)
    other = (r - other_r) ** 2 + (z - high) ** 2
    if other < best:
        best, near_r, near_z, onto_z = other, other_r, high, 1.0
    if length > 0.0:
        along = ((r - low_radius) * side_r + (z - low) * side_z) / (length * length)
        if 0.0 < along < 1.0:
            other_r, other_z = low_radius + along * side_r, low + along * side_z
            other = (r - other_r) ** 2 + (z - other_z) ** 2
            if other < best:
                best, near_r, near_z, onto_z = other, other_r, other_z, 0.0
    distance = math.sqrt(best)
    if distance < 1e-15:
        return (distance - rounding, 0.0, onto_z) if onto_z != 0.0 else (distance - rounding, normal_r, normal_z)
    return distance - rounding, (r - near_r) / distance, (z - near_z) / distance


@kernel
def pose_at(motion: Floats, t: float, pose: Floats) -> None:
    """Write tilt centre and axis at time t into pose (6,). motion: see `deepest`."""
    angle = motion[16]
    for k in range(3):
        pose[k] = motion[k] + t * motion[6 + k]
    if angle == 0.0:
        for k in range(3):
            pose[3 + k] = motion[3 + k]
    else:
        first, second = math.cos(t * angle), math.sin(t * angle)
        for k in range(3):
            pose[3 + k] = first * motion[3 + k] + second * motion[9 + k]


@inlined_kernel
def derivatives(solid: Floats, motion: Floats, pose: Floats, x: float, y: float, z: float, g: Floats) -> None:
    """Write into g (6,): the gradient in the mesh's frame, f, ∂f/∂t and W, at a mesh point and a pose."""
    wx, wy, wz = x - pose[0], y - pose[1], z - pose[2]
    i, j, k = pose[AXIS], pose[AXIS + 1], pose[AXIS + 2]
    height = wx * i + wy * j + wz * k
    rx, ry, rz = wx - height * i, wy - height * j, wz - height * k
    r = math.sqrt(rx * rx + ry * ry + rz * rz)
    f, by_r, by_z = meridian_distance(solid, r, height + motion[17])
    scale = by_r / r if r > 1e-15 else 0.0
    g[0] = scale * rx + by_z * i
    g[1] = scale * ry + by_z * j
    g[2] = scale * rz + by_z * k
    g[VALUE] = f
    _point_moves(motion, wx, wy, wz, g)


@kernel
def lowest_on_way(
    solid: Floats, motion: Floats, pose: Floats, x: float, y: float, z: float, g: Floats, more: Floats
) -> tuple[float, float]:
    """Return the lowest f that is found at a mesh point over a motion whose axis does not turn, and its time.

    Written into g (6,): gradient and value of a plane below f at all points and times. f is convex in both, so that it
    lies above its tangent planes; those at two times between which it is lowest, weighted so that the mean does not
    change with time, bound it. more (2, 6): buffers.
    """
    late, new = more[0], more[1]
    pose_at(motion, 0.0, pose)
    derivatives(solid, motion, pose, x, y, z, g)
    if motion[15] == 0.0 or g[RATE] >= 0.0:
        return g[VALUE], 0.0
    pose_at(motion, 1.0, pose)
    derivatives(solid, motion, pose, x, y, z, late)
    if late[RATE] <= 0.0:
        g[:] = late
        return g[VALUE], 1.0
    low, high = 0.0, 1.0
    best, at = (g[VALUE], low) if g[VALUE] <= late[VALUE] else (late[VALUE], high)
    share, plane = 0.5, -math.inf
    for _ in range(ON_WAY):
        share = late[RATE] / (late[RATE] - g[RATE])
        plane = share * (g[VALUE] - g[RATE] * low) + (1.0 - share) * (late[VALUE] - late[RATE] * high)
        if best - plane <= NEAR_M:
            break
        t = (late[VALUE] - g[VALUE] + g[RATE] * low - late[RATE] * high) / (g[RATE] - late[RATE])
        least = LEAST_STEP * (high - low)
        t = min(max(t, low + least), high - least)
        pose_at(motion, t, pose)
        derivatives(solid, motion, pose, x, y, z, new)
        if new[VALUE] < best:
            best, at = new[VALUE], t
        if new[RATE] < 0.0:
            g[:], low = new, t
        else:
            late[:], high = new, t
    for j in range(3):
        g[j] = share * g[j] + (1.0 - share) * late[j]
    g[VALUE] = plane
    return best, at


@inlined_kernel
def above_base(solid: Floats, motion: Floats, pose: Floats, x: float, y: float, z: float, g: Floats) -> None:
    """Write into g (6,), as `derivatives`, the height of a mesh point below the plane that the solid stands on.

    The solid lies on one side of that plane, so that this is a lower bound of f. On a floor that a flat end touches it
    is 0 throughout, where tangent planes beside the rim say nothing.
    """
    wx, wy, wz = x - pose[0], y - pose[1], z - pose[2]
    for c in range(3):
        g[c] = -pose[AXIS + c]
    g[VALUE] = solid[0] - solid[4] - motion[17] + g[0] * wx + g[1] * wy + g[2] * wz
    _point_moves(motion, wx, wy, wz, g)


@inlined_kernel
def _point_moves(motion: Floats, wx: float, wy: float, wz: float, g: Floats) -> None:
    """Write ∂f/∂t and W into g (6,): the body moves with velocity V + ω × w, in its frame the point the other way."""
    vx = motion[6] + motion[13] * wz - motion[14] * wy
    vy = motion[7] + motion[14] * wx - motion[12] * wz
    vz = motion[8] + motion[12] * wy - motion[13] * wx
    g[RATE] = -(g[0] * vx + g[1] * vy + g[2] * vz)
    g[RADIUS] = math.sqrt(wx * wx + wy * wy + wz * wz)


@kernel
def deviation_bound(motion: Floats, g: Floats, tau: float, size: float) -> float:
    """Return the bound on how far f falls below its tangent plane within ± tau, for offsets up to `size`."""
    angle, travel = motion[16], motion[15]
    bend = angle * angle * (g[RADIUS] + travel * tau + size) + 2.0 * angle * travel
    return abs(g[RATE]) * tau + 0.5 * tau * tau * bend + angle * tau * size


@kernel
def normals_of_all(solids: Floats, tips: Floats, axes: Floats, points: Floats, normals: Floats) -> None:
    """Fill normals (M, 3): from each of M bodies at rest, made of solids (S, 5), to a mesh point.

    tips, axes, points (M, 3).
    """
    still, pose, g = np.zeros(18), np.empty(6), np.empty(6)
    for m in range(len(points)):
        pose[:3], pose[3:], best = tips[m], axes[m], math.inf
        for k in range(len(solids)):
            derivatives(solids[k], still, pose, points[m, 0], points[m, 1], points[m, 2], g)
            if g[VALUE] < best:
                best, normals[m] = g[VALUE], g[:3]
