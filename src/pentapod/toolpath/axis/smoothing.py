"""Smoothing of tool axes along and across a path, and a cap on how fast they may turn per metre of path."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.spatial import KDTree

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import ToolpathError
from pentapod.geometry.directions import angle_between, partway

_ROUNDS = 2
_SAME_SIDE = 0.5
_NEIGHBOURS = 64
_BISECTIONS = 20


def smoothed(points: Floats, axes: Floats, reach: float, tolerance: float) -> Floats:
    """Return axes (N, 3) smoothed over their collision_world, none turned by more than `tolerance` radians.

    points (N, 3): where they stand, of all passes, metres. Each becomes the Gaussian mean of those within `reach`
    metres, on its own pass and the passes beside it, whose axes differ by less than 60°; what leaves the tolerance
    comes back to its edge. So a crease keeps to its tolerance, and noise below it vanishes.
    """
    if tolerance <= 0.0 or len(points) < 2:
        return axes
    weights = _weights(points, axes, reach)
    result = axes
    for _ in range(_ROUNDS):
        mixed = weights @ result
        mixed = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
        angle = angle_between(mixed, axes)
        share = np.minimum(1.0, tolerance / np.maximum(angle, 1e-300))
        result = partway(axes, mixed, share)
    return result


def _weights(points: Floats, axes: Floats, reach: float) -> csr_array:
    """Return the matrix (N, N) of normalised Gaussian weights; a standard deviation is half the reach."""
    count = min(_NEIGHBOURS, len(points))
    found = KDTree(points).query(points, k=count, distance_upper_bound=reach)
    distance, index = np.asarray(found[0]), np.asarray(found[1])
    known = np.isfinite(distance)
    row = np.broadcast_to(np.arange(len(points))[:, None], distance.shape)[known]
    column, d = index[known], distance[known]
    alike = np.einsum("ni,ni->n", axes[row], axes[column]) > _SAME_SIDE
    row, column, d = row[alike], column[alike], d[alike]
    matrix = coo_array((np.exp(-2.0 * (d / reach) ** 2), (row, column)), shape=(len(points), len(points))).tocsr()
    total = np.asarray(matrix.sum(axis=1)).ravel()
    return csr_array(matrix.multiply(1.0 / total[:, None]))


def rate_capped(points: Floats, axes: Floats, rate: float) -> Floats:
    """Return the axes (n, 3) of one pass turned no faster than `rate` radians per metre between any neighbours.

    points (n, 3): along which the pass goes. Where axes turn faster, the whole pass takes the moving mean over the
    shortest stretch that is long enough; a pass that keeps the cap is returned as it is. Raises ToolpathError
    where no mean keeps it, which only opposite axes can bring about.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if len(points) < 2 or (_rates(axes, steps) <= rate).all():
        return axes
    place = np.concatenate([[0.0], np.cumsum(steps)])
    short, long = 0.0, float(np.pi / rate)
    for _ in range(_BISECTIONS):
        trial = _mean(place, axes, long)
        if trial is not None and (_rates(trial, steps) <= rate).all():
            break
        short, long = long, 2.0 * long
    else:
        raise ToolpathError("the axes turn over: no smoothing keeps the cap", key="axis_rate", value=rate)
    result = trial
    for _ in range(_BISECTIONS):
        middle = 0.5 * (short + long)
        trial = _mean(place, axes, middle)
        if trial is not None and (_rates(trial, steps) <= rate).all():
            long, result = middle, trial
        else:
            short = middle
    return result


def _rates(axes: Floats, steps: Floats) -> Floats:
    """Return the turn per metre (n − 1,) between neighbours; a hair less, so that what is set to the cap keeps it."""
    return angle_between(axes[1:], axes[:-1]) / np.maximum(steps, 1e-12) * (1.0 - 1e-9)


def _mean(place: Floats, axes: Floats, width: float) -> Floats | None:
    """Return the exact moving mean over `width` metres of the axes between which lines run; None where it vanishes."""
    # The integral of a polyline is a parabola in each step; beyond the ends the end axes go on.
    steps = np.diff(place)
    slopes = np.diff(axes, axis=0) / np.maximum(steps, 1e-300)[:, None]
    sums = np.vstack([np.zeros(3), np.cumsum(0.5 * steps[:, None] * (axes[1:] + axes[:-1]), axis=0)])

    def integral(s: Floats) -> Floats:
        k = np.clip(np.searchsorted(place, s, side="right") - 1, 0, len(steps) - 1)
        d = (np.clip(s, 0.0, place[-1]) - place[k])[:, None]
        inside = sums[k] + axes[k] * d + 0.5 * slopes[k] * d * d
        return inside + np.minimum(s, 0.0)[:, None] * axes[0] + np.maximum(s - place[-1], 0.0)[:, None] * axes[-1]

    mean = (integral(place + 0.5 * width) - integral(place - 0.5 * width)) / width
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    return None if (length < 1e-3).any() else mean / length


def tangents(points: Floats, starts: Ints) -> Floats:
    """Return unit directions of travel (N, 3) along passes; pass k holds points starts[k] to starts[k + 1] − 1."""
    result = np.empty_like(points)
    for a, b in pairwise(starts.tolist()):
        rows = points[a:b]
        ahead = np.empty_like(rows)
        ahead[1:-1] = rows[2:] - rows[:-2]
        ahead[0], ahead[-1] = rows[1] - rows[0], rows[-1] - rows[-2]
        result[a:b] = ahead
    length = np.linalg.norm(result, axis=1, keepdims=True)
    return result / np.where(length > 0.0, length, 1.0)
