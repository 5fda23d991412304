"""Deepest point of a mesh in a moving convex body, by branch and bound, compiled.

Let f(q, t) be the signed distance of a mesh point q from the body at time t in [0, 1], negative inside. In the body's
own frame f is convex and its gradient g has length 1, so a tangent plane bounds it from below. Over a box or a triangle
with centre c and offsets δ, and over the times s ± τ,

    f ≥ f(c, s) + min g·δ − |∂f/∂t| τ − ½ τ² (θ² W + 2 θ V) − θ τ max|δ|

with θ the angle that the axis turns, V the distance that the tilt centre moves, and W the distance of the point from
the tilt centre: the last two terms bound the deviation of the motion, in the body's frame, from a straight line. The
body stands on a plane, whose distance bounds f likewise. Boxes and triangles that cannot contain a deeper point than
the best known are dropped; the others are halved in space or in time, whichever makes the bound worse. Where the body
does not turn, f is convex in space and time together: its lowest value over the motion is, and space alone is halved.
Where it rests as well, most facets are told without halving (`rest_kernels`).
"""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.mesh.query.kernels.body_kernels import (
    RATE,
    VALUE,
    above_base,
    derivatives,
    deviation_bound,
    lowest_on_way,
    pose_at,
)
from pentapod.mesh.query.kernels.box_kernels import box_radius
from pentapod.mesh.query.kernels.facet_kernels import (
    STACK,
    WORK,
    counts_below,
    deepest_in_facet,
    deepest_in_facet_at_rest,
)
from pentapod.numerics.kernels import inlined_kernel, kernel


@kernel
def _above_box(solid: Floats, motion: Floats, pose: Floats, box: Floats, tau: float, g: Floats) -> float:
    """Return the lower bound of f over a box and times that the plane gives on which the solid stands; g: a buffer."""
    turns = motion[16] != 0.0
    if not turns:
        pose_at(motion, 0.0, pose)
    above_base(solid, motion, pose, box[0], box[1], box[2], g)
    # Of a solid that does not turn the plane moves evenly.
    off = deviation_bound(motion, g, tau, box_radius(box)) if turns else max(-g[RATE], 0.0)
    return g[VALUE] - _fall(box, g) - off


@inlined_kernel
def _fall(box: Floats, g: Floats) -> float:
    """Return by how much a plane with gradient g falls from the middle of a box (15,) to its lowest corner."""
    fall = 0.0
    for k in range(3):
        fall += box[3 + k] * abs(g[0] * box[6 + 3 * k] + g[1] * box[7 + 3 * k] + g[2] * box[8 + 3 * k])
    return fall


@kernel
def _about_box(
    solid: Floats, motion: Floats, pose: Floats, box: Floats, s: float, tau: float, g: Floats, more: Floats
) -> float:
    """Write into g (6,) a plane below f about the middle of a box (15,); return by how much f may fall below it."""
    if motion[16] == 0.0:
        lowest_on_way(solid, motion, pose, box[0], box[1], box[2], g, more)
        return 0.0
    pose_at(motion, s, pose)
    derivatives(solid, motion, pose, box[0], box[1], box[2], g)
    return float(deviation_bound(motion, g, tau, box_radius(box)))


@inlined_kernel
def _children(node: int, boxes: Floats, g: Floats) -> tuple[int, int]:
    """Return both children of a node; last, to be searched first, that with the deeper centre: it prunes the other."""
    left, right = 2 * node + 1, 2 * node + 2
    ahead = 0.0
    for k in range(3):
        ahead += g[k] * (boxes[left, k] - boxes[right, k])
    return (right, left) if ahead < 0.0 else (left, right)


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
    pose, g, base, more = np.empty(6), np.empty(6), np.empty(6), np.empty((2, 6))
    leaves = len(starts) - 1
    facet = -1
    nodes[0, 0], nodes[0, 1], nodes[0, 2] = 0.0, 0.5, 0.5 if motion[16] > 0.0 else 0.0
    count = 1
    while count > 0:
        count -= 1
        node, s, tau = int(nodes[count, 0]), nodes[count, 1], nodes[count, 2]
        box = boxes[node]
        deviation = _about_box(solid, motion, pose, box, s, tau, g, more)
        fall = _fall(box, g)
        least = counts_below(best, eps)
        if (
            g[VALUE] - fall - deviation >= least
            or count + 2 > STACK
            or (_above_box(solid, motion, pose, box, tau, base) >= least)
        ):
            continue
        leaf = node - (leaves - 1)
        if leaf < 0 and deviation <= fall:
            left, right = _children(node, boxes, g)
            nodes[count, 0], nodes[count, 1], nodes[count, 2] = left, s, tau
            nodes[count + 1, 0], nodes[count + 1, 1], nodes[count + 1, 2] = right, s, tau
            count += 2
        elif leaf < 0:
            for half in range(2):
                nodes[count, 0], nodes[count, 1], nodes[count, 2] = node, s + (half - 0.5) * tau, 0.5 * tau
                count += 1
        else:
            for k in range(starts[leaf], starts[leaf + 1]):
                if deepest_in_facet(solid, motion, corners[k], s, tau, best, work, eps, enough, pose, g):
                    facet = k
                    if -best[0] >= enough:
                        return facet
    return facet


@kernel
def _deepest_at_rest(
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
    """As `deepest`, of a solid that neither moves nor turns."""
    pose, g = np.empty(6), np.empty(6)
    leaves = len(starts) - 1
    facet = -1
    nodes[0, 0] = 0.0
    pose_at(motion, 0.0, pose)
    count = 1
    while count > 0:
        count -= 1
        node = int(nodes[count, 0])
        box = boxes[node]
        least = counts_below(best, eps)
        above_base(solid, motion, pose, box[0], box[1], box[2], g)
        if g[VALUE] - _fall(box, g) >= least or count + 2 > STACK:
            continue
        derivatives(solid, motion, pose, box[0], box[1], box[2], g)
        if g[VALUE] - _fall(box, g) >= least:
            continue
        leaf = node - (leaves - 1)
        if leaf < 0:
            nodes[count, 0], nodes[count + 1, 0] = _children(node, boxes, g)
            count += 2
            continue
        for k in range(starts[leaf], starts[leaf + 1]):
            if deepest_in_facet_at_rest(solid, motion, corners[k], best, work, eps, enough, pose, g):
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
    nodes, work, best = np.empty((STACK, 3)), np.empty((STACK + 1, WORK)), np.empty(2 + 3)
    pose, g = np.empty(6), np.empty(6)
    for m in range(len(motions)):
        best[0] = -threshold
        if motions[m, 15] > 0.0 or motions[m, 16] > 0.0:
            facets[m] = deepest(solid, motions[m], corners, boxes, starts, best, nodes, work, eps, enough)
        else:
            # Where poses follow a path, the facet of the last one leaves little of the tree to be searched.
            last, facets[m] = (facets[m - 1] if m > 0 else -1), -1
            if last >= 0 and deepest_in_facet_at_rest(
                solid, motions[m], corners[last], best, work, eps, enough, pose, g
            ):
                facets[m] = last
            if facets[m] < 0 or -best[0] < enough:
                deeper = _deepest_at_rest(solid, motions[m], corners, boxes, starts, best, nodes, work, eps, enough)
                if deeper >= 0:
                    facets[m] = deeper
        if facets[m] >= 0:
            depths[m] = -best[0]
            for j in range(4):
                where[m, j] = best[1 + j]
