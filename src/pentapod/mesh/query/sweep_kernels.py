"""Deepest point of a mesh in a moving convex body, by branch and bound, compiled.

Let f(q, t) be the signed distance of a mesh point q from the body at time t in [0, 1], negative inside. In the body's
own frame f is convex and its gradient g has length 1, so a tangent plane bounds it from below. Over a box or a triangle
with centre c and offsets δ, and over the times s ± τ,

    f ≥ f(c, s) + min g·δ − |∂f/∂t| τ − ½ τ² (θ² W + 2 θ V) − θ τ max|δ|

with θ the angle that the axis turns, V the distance that the tilt centre moves, and W the distance of the point from
the tilt centre: the last two terms bound the deviation of the motion, in the body's frame, from a straight line. Boxes
and triangles that cannot contain a deeper point than the best known are dropped; the others are halved in space or in
time, whichever makes the bound worse.
"""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.mesh.query.box_kernels import box_radius
from pentapod.numerics.kernels import kernel

STACK = 512
"""Pieces that wait to be searched: far more than halving a kilometre down to a tenth of a micrometre needs."""

RELATIVE_ERROR = 1e-2
"""Share of a depth that may be missed, besides `eps`."""

AXIS = 3
"""Index of the axis in a pose."""

VALUE, RATE, RADIUS = range(3, 6)
"""Indices of f, ∂f/∂t and W in what `_derivatives` writes."""


@kernel
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
    near_r, near_z = min(r, low_radius), low
    best = (r - near_r) ** 2 + (z - near_z) ** 2
    other_r = min(r, high_radius)
    other = (r - other_r) ** 2 + (z - high) ** 2
    if other < best:
        best, near_r, near_z = other, other_r, high
    if length > 0.0:
        along = ((r - low_radius) * side_r + (z - low) * side_z) / (length * length)
        if 0.0 < along < 1.0:
            other_r, other_z = low_radius + along * side_r, low + along * side_z
            other = (r - other_r) ** 2 + (z - other_z) ** 2
            if other < best:
                best, near_r, near_z = other, other_r, other_z
    distance = math.sqrt(best)
    if distance < 1e-15:
        return distance - rounding, normal_r, normal_z
    return distance - rounding, (r - near_r) / distance, (z - near_z) / distance


@kernel
def _pose(motion: Floats, t: float, pose: Floats) -> None:
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


@kernel
def _derivatives(solid: Floats, motion: Floats, pose: Floats, x: float, y: float, z: float, g: Floats) -> None:
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
    # The body moves with velocity V + ω × w at the point; in its frame the point moves the opposite way.
    vx = motion[6] + motion[13] * wz - motion[14] * wy
    vy = motion[7] + motion[14] * wx - motion[12] * wz
    vz = motion[8] + motion[12] * wy - motion[13] * wx
    g[RATE] = -(g[0] * vx + g[1] * vy + g[2] * vz)
    g[RADIUS] = math.sqrt(wx * wx + wy * wy + wz * wz)


@kernel
def _deviation_bound(motion: Floats, g: Floats, tau: float, size: float) -> float:
    """Return the bound on how far f falls below its tangent plane within ± tau, for offsets up to `size`."""
    angle, travel = motion[16], motion[15]
    bend = angle * angle * (g[RADIUS] + travel * tau + size) + 2.0 * angle * travel
    return abs(g[RATE]) * tau + 0.5 * tau * tau * bend + angle * tau * size


@kernel
def _deepest_in_facet(
    solid: Floats,
    motion: Floats,
    corners: Floats,
    s: float,
    tau: float,
    best: Floats,
    work: Floats,
    eps: float,
    enough: float,
    pose: Floats,
    g: Floats,
) -> bool:
    """Lower best (5,): f, time and point, within one facet (3, 3) and the times s ± tau; return whether it did."""
    found = False
    for k in range(9):
        work[0, k] = corners[k // 3, k % 3]
    work[0, 9], work[0, 10] = s, tau
    count = 1
    while count > 0:
        count -= 1
        a, b, c = work[count, 0:3].copy(), work[count, 3:6].copy(), work[count, 6:9].copy()
        s, tau = work[count, 9], work[count, 10]
        x, y, z = (a[0] + b[0] + c[0]) / 3.0, (a[1] + b[1] + c[1]) / 3.0, (a[2] + b[2] + c[2]) / 3.0
        _pose(motion, s, pose)
        _derivatives(solid, motion, pose, x, y, z, g)
        if g[VALUE] < best[0]:
            best[0], best[1], best[2], best[3], best[4] = g[VALUE], s, x, y, z
            found = True
            if -best[0] >= enough:
                return True
        lowest, size = 0.0, 0.0
        for p in (a, b, c):
            dx, dy, dz = p[0] - x, p[1] - y, p[2] - z
            lowest = min(lowest, g[0] * dx + g[1] * dy + g[2] * dz)
            size = max(size, dx * dx + dy * dy + dz * dz)
        deviation = _deviation_bound(motion, g, tau, math.sqrt(size))
        if g[VALUE] + lowest - deviation >= best[0] - eps + RELATIVE_ERROR * min(best[0], 0.0) or count + 2 > STACK:
            continue
        if deviation > -lowest:
            for half in range(2):
                work[count, 0:3], work[count, 3:6], work[count, 6:9] = a, b, c
                work[count, 9], work[count, 10] = s + (half - 0.5) * tau, 0.5 * tau
                count += 1
        else:
            # Halve the longest side.
            ab = (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2
            bc = (b[0] - c[0]) ** 2 + (b[1] - c[1]) ** 2 + (b[2] - c[2]) ** 2
            ca = (c[0] - a[0]) ** 2 + (c[1] - a[1]) ** 2 + (c[2] - a[2]) ** 2
            if bc >= ab and bc >= ca:
                a, b, c = b, c, a
            elif ca >= ab:
                a, b, c = c, a, b
            middle = 0.5 * (a + b)
            work[count, 0:3], work[count, 3:6], work[count, 6:9] = a, middle, c
            work[count + 1, 0:3], work[count + 1, 3:6], work[count + 1, 6:9] = middle, b, c
            work[count, 9], work[count, 10] = s, tau
            work[count + 1, 9], work[count + 1, 10] = s, tau
            count += 2
    return found


@kernel
def deepest(
    solid: Floats,
    motion: Floats,
    corners: Floats,
    boxes: Floats,
    starts: Ints,
    best: Floats,
    nodes: Floats,
    work: Floats,
    eps: float,
    enough: float,
) -> int:
    """Lower best (5,): f, time and point, over a whole tree; return the facet in tree order, −1 where nothing is lower.

    solid (5,). motion (18,): tilt centre and axis at the start (3 + 3), displacement of the tilt centre (3), the axis a
    quarter turn later (3), the angular velocity (3), the length of the displacement, the angle, and the height of the
    tilt centre above the tip. best[0] on entry is the threshold: only deeper points are searched. nodes, work: buffers.
    enough: the search ends at a point this deep.
    """
    pose, g = np.empty(6), np.empty(6)
    leaves = len(starts) - 1
    facet = -1
    nodes[0, 0], nodes[0, 1], nodes[0, 2] = 0.0, 0.5, 0.5 if motion[15] > 0.0 or motion[16] > 0.0 else 0.0
    count = 1
    while count > 0:
        count -= 1
        node, s, tau = int(nodes[count, 0]), nodes[count, 1], nodes[count, 2]
        box = boxes[node]
        _pose(motion, s, pose)
        _derivatives(solid, motion, pose, box[0], box[1], box[2], g)
        fall = 0.0
        for k in range(3):
            fall += box[3 + k] * abs(g[0] * box[6 + 3 * k] + g[1] * box[7 + 3 * k] + g[2] * box[8 + 3 * k])
        deviation = _deviation_bound(motion, g, tau, box_radius(box))
        if g[VALUE] - fall - deviation >= best[0] - eps + RELATIVE_ERROR * min(best[0], 0.0) or count + 2 > STACK:
            continue
        leaf = node - (leaves - 1)
        if leaf < 0 and deviation <= fall:
            # Search the child with the deeper centre first: its result prunes the other.
            left, right = 2 * node + 1, 2 * node + 2
            ahead = 0.0
            for k in range(3):
                ahead += g[k] * (boxes[left, k] - boxes[right, k])
            if ahead < 0.0:
                left, right = right, left
            nodes[count, 0], nodes[count, 1], nodes[count, 2] = left, s, tau
            nodes[count + 1, 0], nodes[count + 1, 1], nodes[count + 1, 2] = right, s, tau
            count += 2
        elif leaf < 0:
            for half in range(2):
                nodes[count, 0], nodes[count, 1], nodes[count, 2] = node, s + (half - 0.5) * tau, 0.5 * tau
                count += 1
        else:
            for k in range(starts[leaf], starts[leaf + 1]):
                if _deepest_in_facet(solid, motion, corners[k], s, tau, best, work, eps, enough, pose, g):
                    facet = k
                    if -best[0] >= enough:
                        return facet
    return facet


@kernel
def sweep_all(
    solid: Floats,
    motions: Floats,
    corners: Floats,
    boxes: Floats,
    starts: Ints,
    threshold: float,
    eps: float,
    enough: float,
    depths: Floats,
    where: Floats,
    facets: Ints,
) -> None:
    """Fill depths (M,), where (M, 4): time and point, and facets (M,), −1 where none is deeper than the threshold.

    enough: a depth beyond which no deeper point is searched.
    """
    nodes, work, best = np.empty((STACK, 3)), np.empty((STACK, 11)), np.empty(2 + 3)
    for m in range(len(motions)):
        best[0] = -threshold
        facets[m] = deepest(solid, motions[m], corners, boxes, starts, best, nodes, work, eps, enough)
        if facets[m] >= 0:
            depths[m] = -best[0]
            for j in range(4):
                where[m, j] = best[1 + j]
