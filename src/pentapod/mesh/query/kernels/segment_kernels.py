"""Nearest facets of a mesh to points and to linearly moving points, by branch and bound through the tree of boxes.

For short motions near the mesh the tangents at their ends bound the distance well (`ball_kernels`). For long or distant
ones the distance of the segment from the sphere around each box is the better bound, until boxes are small. For points
boxes along the axes are quicker than those along the surface.
"""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.mesh.query.kernels.ball_kernels import (
    EXACT_M,
    ROUNDS,
    facet_distance,
    facet_square,
    lower_bound,
    nearest_time,
    slope,
)
from pentapod.mesh.query.kernels.box_kernels import box_radius, open_node
from pentapod.numerics.kernels import kernel

STACK = 128
"""Nodes that wait to be searched: more than twice the depth of any tree."""


@kernel
def _bound(box: Floats, start: Floats, travel: Floats, square: float, enough: float, g: Floats) -> float:
    """Return a lower bound on the distance of a segment, of squared length `square`, from a box (15,).

    Where the square is negative only tangents are used, which is best for short segments near the mesh.
    """
    if square < 0.0:
        return lower_bound(box, start, travel, enough, g)
    x, y, z = box[0] - start[0], box[1] - start[1], box[2] - start[2]
    t = 0.0
    if square > 0.0:
        t = min(max((x * travel[0] + y * travel[1] + z * travel[2]) / square, 0.0), 1.0)
    x, y, z = x - t * travel[0], y - t * travel[1], z - t * travel[2]
    ball = math.sqrt(x * x + y * y + z * z) - box_radius(box)
    if ball >= enough:
        return ball
    return max(ball, lower_bound(box, start, travel, enough, g))


@kernel
def _segment_distance(
    p: Floats, start: Floats, travel: Floats, square: float, enough: float, g: Floats
) -> tuple[float, float]:
    """Return the distance of a segment from a facet (3, 3), and where on it; any value above `enough` if it is larger.

    The distance of a point is a convex function of its place on the segment; tangents enclose its minimum.
    """
    t0, t1 = 0.0, 1.0
    # Begin at the place nearest to the facet's middle: most facets are too far away to matter.
    mx = (p[0, 0] + p[1, 0] + p[2, 0]) / 3.0 - start[0]
    my = (p[0, 1] + p[1, 1] + p[2, 1]) / 3.0 - start[1]
    mz = (p[0, 2] + p[1, 2] + p[2, 2]) / 3.0 - start[2]
    t = 0.0
    if square > 0.0:
        t = min(max((mx * travel[0] + my * travel[1] + mz * travel[2]) / square, 0.0), 1.0)
    low0 = low1 = -math.inf
    s0, s1 = -1.0, 1.0
    best, when = math.inf, t
    for round_ in range(ROUNDS):
        d = facet_distance(p, start[0] + t * travel[0], start[1] + t * travel[1], start[2] + t * travel[2], g)
        if d < best:
            best, when = d, t
        s = slope(g, d, travel)
        if s < 0.0 and t < 1.0:
            t0, low0, s0 = t, d, s
        elif s > 0.0 and t > 0.0:
            t1, low1, s1 = t, d, s
        else:
            break
        if low0 == -math.inf or low1 == -math.inf:
            end = 1.0 if s < 0.0 else 0.0
            if d + s * (end - t) >= min(enough, best - EXACT_M):
                break
            t = end
            continue
        meet = (low1 - s1 * t1 - low0 + s0 * t0) / (s0 - s1)
        if low0 + s0 * (meet - t0) >= min(enough, best - EXACT_M):
            break
        # At a kink tangents converge slowly: every third time the middle is taken.
        t = 0.5 * (t0 + t1) if round_ % 3 == 2 or not t0 < meet < t1 else meet
    if best < enough:
        facet_distance(p, start[0] + when * travel[0], start[1] + when * travel[1], start[2] + when * travel[2], g)
    return best, when


@kernel
def nearest_all(
    starts: Floats,
    travels: Floats,
    corners: Floats,
    boxes: Floats,
    leaf_starts: Ints,
    within: float,
    far: bool,
    distances: Floats,
    where: Floats,
    facets: Ints,
) -> None:
    """Fill distances (M,), where (M, 4): share of the travel and mesh point, and facets (M,), −1 where none is nearer.

    starts, travels (M, 3): each point moves linearly from starts to starts + travels. within: only facets nearer than
    this are searched. far: motions may be long and far from the mesh; otherwise they are short and near it.
    """
    nodes, bounds, g = np.empty(STACK, dtype=np.intp), np.empty(STACK), np.empty(3)
    leaves = len(leaf_starts) - 1
    for m in range(len(starts)):
        start, travel, best = starts[m], travels[m], within
        square = travel[0] * travel[0] + travel[1] * travel[1] + travel[2] * travel[2] if far else -1.0
        facets[m] = -1
        nodes[0], bounds[0] = 0, _bound(boxes[0], start, travel, square, best, g)
        count = 1
        while count > 0:
            count -= 1
            node = nodes[count]
            if bounds[count] >= best:
                continue
            leaf = node - (leaves - 1)
            if leaf < 0:
                near = _bound(boxes[2 * node + 1], start, travel, square, best, g)
                last = _bound(boxes[2 * node + 2], start, travel, square, best, g)
                count = open_node(node, near, last, best, count, nodes, bounds)
            else:
                for k in range(leaf_starts[leaf], leaf_starts[leaf + 1]):
                    if far:
                        distance, t = _segment_distance(corners[k], start, travel, square, best, g)
                    else:
                        distance, t = nearest_time(corners[k], start, travel, best, g)
                    if distance < best:
                        best, facets[m] = distance, k
                        distances[m], where[m, 0] = distance, t
                        for j in range(3):
                            where[m, 1 + j] = start[j] + t * travel[j] - g[j]


@kernel
def all_clear(
    starts: Floats, travels: Floats, corners: Floats, boxes: Floats, leaf_starts: Ints, least: float, clear: Bools
) -> None:
    """Fill clear (M,): whether points that move from starts to starts + travels stay `least` away from the mesh.

    starts, travels (M, 3): metres, best for short motions near the mesh. A search ends with the first facet that is
    nearer.
    """
    nodes, bounds, g, leaves = np.empty(STACK, dtype=np.intp), np.empty(STACK), np.empty(3), len(leaf_starts) - 1
    for m in range(len(starts)):
        start, travel = starts[m], travels[m]
        nodes[0], count, found = 0, 1, False
        while count > 0 and not found:
            count -= 1
            node = nodes[count]
            leaf = node - (leaves - 1)
            if leaf >= 0:
                for k in range(leaf_starts[leaf], leaf_starts[leaf + 1]):
                    if nearest_time(corners[k], start, travel, least, g)[0] < least:
                        found = True
                        break
                continue
            near = lower_bound(boxes[2 * node + 1], start, travel, least, g)
            last = lower_bound(boxes[2 * node + 2], start, travel, least, g)
            count = open_node(node, near, last, least, count, nodes, bounds)
        clear[m] = not found


@kernel
def _box_square(extent: Floats, x: float, y: float, z: float) -> float:
    """Return the squared distance of a point from a box (2, 3)."""
    dx = max(extent[0, 0] - x, 0.0, x - extent[1, 0])
    dy = max(extent[0, 1] - y, 0.0, y - extent[1, 1])
    dz = max(extent[0, 2] - z, 0.0, z - extent[1, 2])
    return dx * dx + dy * dy + dz * dz


@kernel
def closest(
    x: float, y: float, z: float, within: float, guess: int, corners: Floats, starts: Ints, extents: Floats,
    nodes: Ints, bounds: Floats, away: Floats,
) -> tuple[float, int]:  # fmt: skip
    """Return the distance of a point and the facet that is nearest, −1 where none is nearer than `within`.

    guess: a facet that may be near, −1 for none; the search is quicker. nodes, bounds (STACK,): room for the search.
    away (6,): the vector from the mesh to the point goes into the first three; the others are room.
    """
    best, facet, leaves = max(within, 0.0) ** 2, -1, len(starts) - 1  # distances are compared by their squares
    nodes[0], bounds[0], count = 0, _box_square(extents[0], x, y, z), 1
    g = away[3:]
    if guess >= 0:
        square = facet_square(corners[guess], x, y, z, g)
        if square < best:
            best, facet = square, guess
            away[0], away[1], away[2] = g[0], g[1], g[2]
    while count > 0:
        count -= 1
        if bounds[count] >= best:
            continue
        node = nodes[count]
        while node < leaves - 1:  # down to a leaf, the nearer child first; the other one waits
            first, second = 2 * node + 1, 2 * node + 2
            near, far = _box_square(extents[first], x, y, z), _box_square(extents[second], x, y, z)
            if far < near:
                first, second, near, far = second, first, far, near
            if far < best:
                nodes[count], bounds[count] = second, far
                count += 1
            if near >= best:
                break
            node = first
        if node < leaves - 1:
            continue
        leaf = node - (leaves - 1)
        for f in range(starts[leaf], starts[leaf + 1]):
            square = facet_square(corners[f], x, y, z, g)
            if square < best:
                best, facet = square, f
                away[0], away[1], away[2] = g[0], g[1], g[2]
    return (within if facet < 0 else math.sqrt(best)), facet


@kernel
def closest_of_all(
    points: Floats, within: float, corners: Floats, starts: Ints, extents: Floats,
    distances: Floats, away: Floats, facets: Ints,
) -> None:  # fmt: skip
    """Fill distances (M,), vectors from the mesh (M, 3) and facets (M,) of points (M, 3), as `closest`.

    Neighbours in the order of the points should be near to each other: what is near to one is tried first for the next.
    """
    nodes, bounds, room, last = np.empty(STACK, dtype=np.intp), np.empty(STACK), np.zeros(6), -1
    for m in range(len(points)):
        p = points[m]
        distances[m], facets[m] = closest(p[0], p[1], p[2], within, last, corners, starts, extents, nodes, bounds, room)
        last = facets[m] if facets[m] >= 0 else last
        for k in range(3):
            away[m, k] = room[k] if facets[m] >= 0 else 0.0


@kernel
def all_within(points: Floats, distance: float, corners: Floats, starts: Ints, extents: Floats, within: Bools) -> None:
    """Fill which points (M, 3) are nearer than `distance` to the mesh.

    The facet near to one is tried first for the next. A search ends with the first such facet.
    """
    nodes, leaves, last, g = np.empty(STACK, dtype=np.intp), len(starts) - 1, 0, np.empty(3)
    square = max(distance, 0.0) ** 2
    for m in range(len(points)):
        x, y, z = points[m, 0], points[m, 1], points[m, 2]
        found = facet_square(corners[last], x, y, z, g) < square
        nodes[0], count = 0, 1
        while count > 0 and not found:
            count -= 1
            node = nodes[count]
            leaf = node - (leaves - 1)
            if leaf >= 0:
                for f in range(starts[leaf], starts[leaf + 1]):
                    if facet_square(corners[f], x, y, z, g) < square:
                        found, last = True, f
                        break
                continue
            near, far = 2 * node + 1, 2 * node + 2
            to_near, to_far = _box_square(extents[near], x, y, z), _box_square(extents[far], x, y, z)
            if to_near > to_far:
                near, far, to_near, to_far = far, near, to_far, to_near
            if to_far < square:
                nodes[count] = far
                count += 1
            if to_near < square:
                nodes[count] = near
                count += 1
        within[m] = found
