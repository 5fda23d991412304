"""Deepest point of one facet in a moving convex body, by branch and bound; compiled. Bounds: see `sweep_kernels`."""

from __future__ import annotations

import math

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.mesh.query.kernels.body_kernels import (
    RATE,
    VALUE,
    above_base,
    derivatives,
    deviation_bound,
    lowest_on_way,
    pose_at,
)
from pentapod.mesh.query.kernels.rest_kernels import into_frame, lowest_on_facet, told_at_once
from pentapod.numerics.kernels import inlined_kernel, kernel

STACK = 512
"""Pieces that wait to be searched: far more than halving a kilometre down to a tenth of a micrometre needs."""

WORK = 21
"""Numbers of a waiting piece of a facet: three corners with value and gradient; or three corners and times."""

RELATIVE_ERROR = 1e-2
"""Share of a depth that may be missed, besides `eps`."""


@kernel
def _above_piece(solid: Floats, motion: Floats, pose: Floats, piece: Floats, tau: float, g: Floats) -> float:
    """Return the lower bound of f that the plane gives on which the solid stands; piece: corners first; g: a buffer."""
    lowest, size = np.inf, 0.0
    for p in (1, 2, 0):
        above_base(solid, motion, pose, piece[3 * p], piece[3 * p + 1], piece[3 * p + 2], g)
        lowest = min(lowest, g[VALUE])
        size = max(
            size,
            (piece[3 * p] - piece[0]) ** 2 + (piece[3 * p + 1] - piece[1]) ** 2 + (piece[3 * p + 2] - piece[2]) ** 2,
        )
    return lowest - deviation_bound(motion, g, tau, math.sqrt(size))


@kernel
def _deepest_in_motion(
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
    found, base = False, np.empty(6)
    for k in range(9):
        work[0, k] = corners[k // 3, k % 3]
    work[0, 9], work[0, 10] = s, tau
    count = 1
    while count > 0:
        count -= 1
        a, b, c = work[count, 0:3].copy(), work[count, 3:6].copy(), work[count, 6:9].copy()
        s, tau = work[count, 9], work[count, 10]
        x, y, z = (a[0] + b[0] + c[0]) / 3.0, (a[1] + b[1] + c[1]) / 3.0, (a[2] + b[2] + c[2]) / 3.0
        pose_at(motion, s, pose)
        derivatives(solid, motion, pose, x, y, z, g)
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
        deviation = deviation_bound(motion, g, tau, math.sqrt(size))
        if g[VALUE] + lowest - deviation >= counts_below(best, eps) or count + 2 > STACK:
            continue
        if _above_piece(solid, motion, pose, work[count], tau, base) >= counts_below(best, eps):
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
def _deepest_on_way(
    solid: Floats,
    motion: Floats,
    corners: Floats,
    best: Floats,
    work: Floats,
    eps: float,
    enough: float,
    pose: Floats,
    g: Floats,
) -> bool:
    """Lower best (5,): f, time and point, within one facet (3, 3), where the body does not turn; return whether it did.

    The lowest f over the motion is convex: planes below it at the corners of a piece, and their mean, bound it. Pieces
    are cut across the side along which the slope changes most, about where the slopes say that it is 0: beside a long
    stem they become long and narrow.
    """
    more = np.empty((2, 6))
    if _above_base(solid, motion, pose, corners.ravel(), 3, g) >= counts_below(best, eps):
        return False
    x = (corners[0, 0] + corners[1, 0] + corners[2, 0]) / 3.0
    y = (corners[0, 1] + corners[1, 1] + corners[2, 1]) / 3.0
    z = (corners[0, 2] + corners[1, 2] + corners[2, 2]) / 3.0
    f, t = lowest_on_way(solid, motion, pose, x, y, z, g, more)
    found, lowest = _lowered(best, f, t, x, y, z), 0.0
    for i in range(3):
        lowest = min(lowest, g[0] * (corners[i, 0] - x) + g[1] * (corners[i, 1] - y) + g[2] * (corners[i, 2] - z))
    if (found and -best[0] >= enough) or g[VALUE] + lowest >= counts_below(best, eps):
        return found
    for i in range(3):
        x, y, z = corners[i, 0], corners[i, 1], corners[i, 2]
        f, t = lowest_on_way(solid, motion, pose, x, y, z, g, more)
        found = _lowered(best, f, t, x, y, z) or found
        _keep(work[0], 7 * i, g, x, y, z)
    count, cut = 1, work[STACK]
    while count > 0 and not (found and -best[0] >= enough):
        count -= 1
        piece = work[count]
        if (
            _least(piece, cut) >= counts_below(best, eps)
            or count + 2 > STACK
            or _above_base(solid, motion, pose, piece, 7, g) >= counts_below(best, eps)
        ):
            continue
        a, b, share = int(cut[0]), int(cut[1]), cut[2]
        x = piece[a] + share * (piece[b] - piece[a])
        y = piece[a + 1] + share * (piece[b + 1] - piece[a + 1])
        z = piece[a + 2] + share * (piece[b + 2] - piece[a + 2])
        f, t = lowest_on_way(solid, motion, pose, x, y, z, g, more)
        found = _lowered(best, f, t, x, y, z) or found
        for j in range(WORK):
            work[count + 1, j] = piece[j]
        _keep(work[count], a, g, x, y, z)
        _keep(work[count + 1], b, g, x, y, z)
        count += 2
    return found


@kernel
def _above_base(solid: Floats, motion: Floats, pose: Floats, piece: Floats, each: int, g: Floats) -> float:
    """Return the lower bound of f on a triangle that the plane gives on which a solid that does not turn stands.

    piece: the corners, `each` numbers apart; g: a buffer. On the motion the plane moves evenly.
    """
    pose_at(motion, 0.0, pose)
    lowest = np.inf
    for i in range(3):
        above_base(solid, motion, pose, piece[each * i], piece[each * i + 1], piece[each * i + 2], g)
        lowest = min(lowest, g[VALUE])
    return lowest + min(g[RATE], 0.0)


@inlined_kernel
def counts_below(best: Floats, eps: float) -> float:
    """Return the lower bound from which on a piece holds nothing that counts as deeper."""
    return best[0] - eps + RELATIVE_ERROR * min(best[0], 0.0)


@kernel
def _lowered(best: Floats, f: float, t: float, x: float, y: float, z: float) -> bool:
    """Lower best (5,) to f at a time and a point, where it is lower; return whether it is."""
    if f >= best[0]:
        return False
    best[0], best[1], best[2], best[3], best[4] = f, t, x, y, z
    return True


@kernel
def _keep(piece: Floats, at: int, g: Floats, x: float, y: float, z: float) -> None:
    """Write a corner of a piece (21,), from index `at` on: the point, f and its gradient."""
    piece[at], piece[at + 1], piece[at + 2], piece[at + 3] = x, y, z, g[VALUE]
    for j in range(3):
        piece[at + 4 + j] = g[j]


@kernel
def _least(piece: Floats, cut: Floats) -> float:
    """Return a lower bound of f on a piece (21,); write into cut: corners of the side to cut, and the share."""
    bound, bend = -np.inf, -1.0
    mean = cut[3:6]
    mean[0] = mean[1] = mean[2] = 0.0
    for i in range(3):
        a, b, c = 7 * i, 7 * ((i + 1) % 3), 7 * ((i + 2) % 3)
        to_b, to_c, back = 0.0, 0.0, 0.0
        for j in range(3):
            to_b += piece[a + 4 + j] * (piece[b + j] - piece[a + j])
            to_c += piece[a + 4 + j] * (piece[c + j] - piece[a + j])
            back += piece[b + 4 + j] * (piece[b + j] - piece[a + j])
        f = piece[a + 3]
        bound = max(bound, f + min(0.0, to_b, to_c))
        mean[i] += f / 3.0
        mean[(i + 1) % 3] += (f + to_b) / 3.0
        mean[(i + 2) % 3] += (f + to_c) / 3.0
        if back - to_b > bend:
            bend, cut[0], cut[1], cut[2] = back - to_b, a, b, 0.5
            if to_b < 0.0 < back:
                cut[2] = min(max(to_b / (to_b - back), 0.1), 0.9)
    return max(bound, min(mean[0], mean[1], mean[2]))


@kernel
def deepest_in_facet_at_rest(
    solid: Floats,
    motion: Floats,
    corners: Floats,
    best: Floats,
    work: Floats,
    eps: float,
    enough: float,
    pose: Floats,
    g: Floats,
) -> bool:
    """Lower best (5,): f, time and point, within one facet (3, 3), where the body rests; return whether it did."""
    own, lowest = work[0, :9].reshape(3, 3), work[0, 9:13]
    into_frame(motion, corners, own)
    bound = told_at_once(solid, own, lowest)
    if bound >= counts_below(best, eps):
        return False
    if bound < lowest[0] - eps:
        bound = max(bound, lowest_on_facet(solid, own, lowest, counts_below(best, eps), eps))
    x = lowest[1] * corners[0, 0] + lowest[2] * corners[1, 0] + lowest[3] * corners[2, 0]
    y = lowest[1] * corners[0, 1] + lowest[2] * corners[1, 1] + lowest[3] * corners[2, 1]
    z = lowest[1] * corners[0, 2] + lowest[2] * corners[1, 2] + lowest[3] * corners[2, 2]
    found = _lowered(best, lowest[0], 0.0, x, y, z)
    if (found and -best[0] >= enough) or bound >= counts_below(best, eps):
        return found
    return _deepest_on_way(solid, motion, corners, best, work, eps, enough, pose, g) or found


@kernel
def deepest_in_facet(
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
    if motion[16] != 0.0:
        return _deepest_in_motion(solid, motion, corners, s, tau, best, work, eps, enough, pose, g)
    return _deepest_on_way(solid, motion, corners, best, work, eps, enough, pose, g)
