"""Kernels of the free-space diagram of two polylines (Alt and Godau 1995), in one pass along the motion.

A motion of M samples and a path of n waypoints. Cell (i, k) belongs to chord i of the motion and interval k of the
path. Its left side is sample i along interval k, its bottom is waypoint k along chord i. The part of a side where both
curves are close enough to each other is free; in each cell the free part is convex. So the places that a monotone
matching can reach are an interval of each side, and follow from those of the previous sides. Only sides that can be
reached are computed: for a motion that follows its path a few cells for each sample.

Each side also keeps the cheapest *route* to it: the order of sides with the least sum of squared distances. A route may
be lost where a more expensive one would have continued; what can be reached is never lost.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.kernels import kernel

Curve = tuple[Floats, Floats]
"""Points and axes (n, 3) of a polyline. A side is a vertex `at` of one of them along the chord `k` of the other."""

Bounds = tuple[Floats, Floats, float, Floats]
"""Largest distance, metres, of path and motion: chords (M − 1,) on each chord; samples (M,) at each sample; what is
added where axes have a weight; and turns (n − 1,): the largest squared distance of the axes' ends on each interval of
the path."""

Weights = tuple[Floats, Floats, float]
"""Cost of a squared distance between axes relative to one between points, m²: intervals (n − 1,), waypoints (n,); and
the tolerated squared distance, m², beyond which as few samples and waypoints as possible should be."""

Reached = tuple[float, float, float]
"""How a side can be reached: earliest place of all, earliest place of its route, cost of its route; infinite if not."""

Cells = tuple[Ints, NDArray[np.int32], NDArray[np.uint8]]
"""first (M,): where the cells of each chord begin; intervals (C,) of the cells; ways (C,): flags, from where the sides
right (1 left, 2 bottom by the route; 16, 32 at all) and top (4, 8; 64, 128) are reached."""


BEYOND_COST = 100.0
"""Cost of a sample or waypoint beyond the tolerated distance, relative to one at that distance."""

TURN_COST = 1000.0
"""Factor on the cost of a waypoint where the path turns on the spot: there samples may be many, and say little."""


@kernel
def stretch(a: Floats, at: int, b: Floats, k: int, within: float) -> tuple[float, float]:
    """Return the part in [0, 1] of b[k] to b[k + 1] that is within a squared distance of a[at]; (1, 0) for none.

    An end is in or out by its own distance, so that sides that share a corner agree about it.
    """
    square, along, first, last = 0.0, 0.0, 0.0, 0.0
    for q in range(3):
        d, f, e = b[k + 1, q] - b[k, q], a[at, q] - b[k, q], a[at, q] - b[k + 1, q]
        square += d * d
        along += d * f
        first += f * f
        last += e * e
    if first <= within and last <= within:
        return 0.0, 1.0
    inside = along * along - square * (first - within)
    if square == 0.0 or (inside < 0.0 and first > within and last > within):
        return 1.0, 0.0
    root = math.sqrt(max(inside, 0.0))
    low, high = (along - root) / square, (along + root) / square
    if first > within and last > within and (high < 0.0 or low > 1.0):
        return 1.0, 0.0
    low = 0.0 if first <= within else min(max(low, 0.0), 1.0)
    return low, 1.0 if last <= within else min(max(high, 0.0), 1.0)


@kernel
def free(one: Curve, at: int, other: Curve, k: int, near: float, turn: float) -> tuple[float, float]:
    """Return the free part of a side: within `near`, metres, and the ends of axes within a squared distance `turn`."""
    if near < 0.0:
        return 1.0, 0.0
    low, high = stretch(one[0], at, other[0], k, near * near)
    if low <= high and turn < 4.0:
        least, most = stretch(one[1], at, other[1], k, turn)
        low, high = max(low, least), min(high, most)
    return low, high


@kernel
def closest(one: Curve, at: int, other: Curve, k: int, weight: float, low: float, high: float) -> tuple[float, float]:
    """Return the place in [low, high] of a side with the least squares, of distance and turn; the distance squared."""
    (p, u), (a, v) = one, other
    square, along = 0.0, 0.0
    for q in range(3):
        d = a[k + 1, q] - a[k, q]
        square += d * d
        along += d * (p[at, q] - a[k, q])
        if weight > 0.0:
            d = v[k + 1, q] - v[k, q]
            square += weight * d * d
            along += weight * d * (u[at, q] - v[k, q])
    place = min(max(along / square if square > 0.0 else 0.0, low), high)
    return place, apart(p, at, a, k, place)


@kernel
def apart(a: Floats, at: int, b: Floats, k: int, place: float) -> float:
    """Return the squared distance of a[at] to a place on the line from b[k] to b[k + 1]."""
    square = 0.0
    for q in range(3):
        square += (a[at, q] - b[k, q] - place * (b[k + 1, q] - b[k, q])) ** 2
    return square


@kernel
def cost_of(
    one: Curve, at: int, other: Curve, k: int, weights: tuple[float, float, float, float], low: float, high: float
) -> float:
    """Return the cost of a side within [low, high]: the squared distances; far more beyond the tolerated distance.

    So as few samples and waypoints as possible are beyond it. weights: of a turn for the place, for the cost; of both;
    and the tolerated squared distance.
    """
    place, cost = closest(one, at, other, k, weights[0], low, high)
    if cost > weights[3]:
        cost = BEYOND_COST * weights[3] + math.sqrt(cost * weights[3])
    if weights[1] > 0.0:
        cost += weights[1] * apart(one[1], at, other[1], k, place)
    return weights[2] * cost


@kernel
def reach(
    one: Curve,
    at: int,
    other: Curve,
    k: int,
    bounds: tuple[float, float, float],
    weights: tuple[float, float, float, float],
    straight: Reached,
    across: Reached,
) -> tuple[Reached, int, float]:
    """Return how a side can be reached from the opposite one (straight) and from the one beside it (across).

    Also flags (1 straight, 2 across for the route; 16, 32 for any matching), and the least distance there less `near`;
    −∞ where axes have a weight. bounds: near, what is added to it, turn. weights: as for `cost_of`.
    """
    near, turn = bounds[0] + (bounds[1] if weights[0] > 0.0 else 0.0), bounds[2]
    nothing, flags = math.inf, 0
    low, high = free(one, at, other, k, near, turn)
    if low > high or (across[0] == nothing and max(low, straight[0]) > high):
        return (nothing, nothing, nothing), 0, nothing
    earliest = low if across[0] < nothing else max(low, straight[0])
    _, square = closest(one, at, other, k, 0.0, earliest, high)
    begin, cost = nothing, nothing
    if across[2] < nothing:
        begin, cost, flags = low, across[2] + cost_of(one, at, other, k, weights, low, high), 2
    if straight[2] < nothing and max(low, straight[1]) <= high:
        ahead = straight[2] + cost_of(one, at, other, k, weights, max(low, straight[1]), high)
        if ahead <= cost:
            begin, cost, flags = max(low, straight[1]), ahead, 1
    beyond = -nothing if weights[0] > 0.0 else math.sqrt(square) - near
    return (earliest, begin, cost), flags | (32 if across[0] < nothing else 16), beyond


@kernel
def walk(motion: Curve, path: Curve, bounds: Bounds, weights: Weights, most: int) -> tuple[int, bool, float, Cells]:
    """Return (samples reached, whether there is a route, spare, cells).

    All M samples are reached if and only if a matching within the bounds exists. spare: largest, over all samples and
    waypoints, of the least distance beyond the bound of any such matching; not positive. −1 samples are reached where
    that would take more than `most` cells.
    """
    chords, samples, more, turns = bounds
    intervals, waypoints, fair = weights
    count, n, nothing = len(motion[0]), len(path[0]), math.inf
    first = np.zeros(count, dtype=np.int64)
    cell, ways = np.empty(2 * count + n, dtype=np.int32), np.empty(2 * count + n, dtype=np.uint8)
    on, reached = np.empty((2, n), dtype=np.int64), np.empty((2, n, 3))
    least, spare, cells = np.full(n, nothing), math.sqrt(apart(motion[0], 0, path[0], 0, 0.0)) - samples[0], 0
    low, high = free(motion, 0, path, 0, samples[0] + (more if intervals[0] > 0.0 else 0.0), turns[0])
    if low > 0.0 or low > high:
        return 0, False, nothing, (first, cell, ways)
    on[0, 0], reached[0, 0], active = 0, 0.0, 1
    for i in range(count - 1):
        now, then = i % 2, 1 - i % 2
        first[i] = cells
        bottom, k, at, following, nearest = (nothing, nothing, nothing), -1, 0, 0, nothing
        while at < active or bottom[0] < nothing:
            k = k + 1 if bottom[0] < nothing else on[now, at]
            left = (nothing, nothing, nothing)
            if at < active and on[now, at] == k:
                left = (reached[now, at, 0], reached[now, at, 1], reached[now, at, 2])
                at += 1
            # The axis also counts next to a turn on the spot; otherwise that would be cheaper than the turn itself.
            counted = max(intervals[max(k - 1, 0)], intervals[k], intervals[min(k + 1, n - 2)])
            bound, cost = (samples[i + 1], more, turns[k]), (intervals[k], counted, 1.0, fair)
            right, flags, beyond = reach(motion, i + 1, path, k, bound, cost, left, bottom)
            if flags:
                on[then, following], reached[then, following] = k, right
                following += 1
                nearest = min(nearest, beyond)
            top, above = (nothing, nothing, nothing), 0
            if k + 2 < n:
                bound = (chords[i], more, max(turns[k], turns[k + 1]))
                counted = waypoints[k + 1]
                cost = (counted, counted, TURN_COST if counted > 0.0 else 1.0, fair)
                top, above, beyond = reach(path, k + 1, motion, i, bound, cost, bottom, left)
                least[k + 1] = min(least[k + 1], beyond)
                # Of a top the bottom lies straight and the left across.
                flags |= ((above & 2) << 1) | ((above & 1) << 3) | ((above & 32) << 1) | ((above & 16) << 3)
            if flags:
                if cells == len(cell):
                    if cells >= most:
                        return -1, False, nothing, (first, cell, ways)
                    cell = np.concatenate((cell, np.empty(cells, dtype=np.int32)))
                    ways = np.concatenate((ways, np.empty(cells, dtype=np.uint8)))
                cell[cells], ways[cells] = k, flags
                cells += 1
            bottom = top
        if following == 0:
            return i + 1, False, nothing, (first, cell, ways)
        active, spare = following, max(spare, nearest)
    first[count - 1], last = cells, (count - 1) % 2
    low, high = free(motion, count - 1, path, n - 2, samples[-1] + (more if intervals[-1] > 0.0 else 0.0), turns[-1])
    if on[last, active - 1] != n - 2 or low > high or high < 1.0:
        return count - 1, False, nothing, (first, cell, ways)
    least[-1] = math.sqrt(apart(motion[0], count - 1, path[0], n - 2, 1.0)) - samples[-1]
    spare = max(spare, least[1:].max())
    return count, reached[last, active - 1, 2] < nothing, spare, (first, cell, ways)


@kernel
def trace(cells: Cells, by_route: bool, interval: Ints, chord: Ints) -> None:
    """Fill the interval (M,) of each sample and the chord (n,) of each waypoint, from the end back to the start."""
    first, cell, ways = cells
    left = 1 if by_route else 16
    i, k = len(interval) - 2, len(chord) - 2
    interval[i + 1], chord[0], chord[-1] = k, 0, i
    by_right = True  # whether the cell is left by its right side, not by its top
    while i >= 0:
        low, high = first[i], first[i + 1]
        while high - low > 1:
            middle = (low + high) // 2
            if cell[middle] <= k:
                low = middle
            else:
                high = middle
        by_left = bool(ways[low] & (left if by_right else 4 * left))
        if by_left:
            interval[i] = k
            i -= 1
        else:
            chord[k] = i
            k -= 1
        by_right = by_left


@kernel
def free_sides(
    motion: Curve,
    path: Curve,
    bounds: Bounds,
    weights: Weights,
    interval: Ints,
    chord: Ints,
    at_samples: Floats,
    at_waypoints: Floats,
) -> None:
    """Fill the free part of each side of a route: at_samples (M, 2) and at_waypoints (n, 3), from and to.

    Of waypoints also the cheapest place.
    """
    chords, samples, more, turns = bounds
    for i in range(len(interval)):
        k = interval[i]
        near = samples[i] + (more if weights[0][k] > 0.0 else 0.0)
        at_samples[i, 0], at_samples[i, 1] = free(motion, i, path, k, float(near), float(turns[k]))
    for k in range(len(chord)):
        i, turn = chord[k], max(turns[max(k - 1, 0)], turns[min(k, len(turns) - 1)])
        near = chords[i] + (more if weights[1][k] > 0.0 else 0.0)
        low, high = free(path, k, motion, i, float(near), float(turn))
        at, _ = closest(path, k, motion, i, weights[1][k], low, high)
        at_waypoints[k, 0], at_waypoints[k, 1], at_waypoints[k, 2] = low, high, at
