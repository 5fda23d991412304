"""Smoothing of tool axes along and across passes, and a limit of their turn per metre of path."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.spatial import KDTree

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import ToolpathError
from pentapod.geometry.directions import angle_between, normalised, partway
from pentapod.numerics.threads import nearest_points


@dataclass(frozen=True)
class AxisSmoothingOptions:
    """How axes are averaged.

    rounds: of averaging. similar: cosine of the angle between axes up to which they are averaged: sides of a crease are
    not. neighbours: largest number of axes in a mean; thinned: edge of the cubes of which each has one axis in it, as a
    share of the reach, as is ridge: distance over which axes do not turn by regression alone. bisections: for the
    shortest moving mean. least_noise: standard deviation of the noise in radians, on either direction across, below
    which axes are clean; noises: tolerance for noisy ones, as a multiple of it, at most `widest` radians. apart: of the
    places between which noise is looked for, as a share of the reach. fewest: places from which noise is estimated, at
    least. finer: axes between two places whose turns are looked at; a median turn below the share `turning` of the
    noise is that of flat facets. median: of the product of neighbouring fourth differences of normal noise, in
    variances, with the other sign.
    """

    rounds: int = 2
    similar: float = 0.5
    neighbours: int = 200
    thinned: float = 0.15
    ridge: float = 0.1
    bisections: int = 20
    least_noise: float = float(np.radians(0.4))
    noises: float = 12.0
    widest: float = float(np.radians(60.0))
    apart: float = 1.0 / 3.0
    fewest: int = 30
    finer: int = 4
    turning: float = 0.1
    median: float = 2.06


def noise_tolerance(
    points: Floats, axes: Floats, starts: Ints, reach: float, options: AxisSmoothingOptions = AxisSmoothingOptions()
) -> float:
    """Return the tolerance for `smoothed` that the noise of axes (N, 3) asks for, radians; 0 for clean ones.

    points (N, 3): of all passes, metres; pass k holds points starts[k] to starts[k + 1] − 1. Noise is what is left in
    fourth differences over a share of the reach: of a surface that bends, two neighbouring ones are alike, those of
    noise are opposite. Medians leave out creases; flat facets between creases do not turn at all.
    """
    products, turns, step = [np.zeros(0)], [np.zeros(0)], options.apart * reach / options.finer
    for a, b in pairwise(starts.tolist()):
        place = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points[a:b], axis=0), axis=1))])
        at = np.arange(0.0, place[-1], step)
        few = np.stack([np.interp(at, place, axes[a:b, k]) for k in range(3)], axis=1)
        turns.append(np.linalg.norm(np.diff(few, axis=0), axis=1))
        off = np.diff(few[:: options.finer], 4, axis=0) / 6.0
        products.append(np.einsum("ni,ni->n", off[1:], off[:-1]))
    product = np.concatenate(products)
    if len(product) < options.fewest:
        return 0.0
    noise = float(np.sqrt(max(-np.median(product) / options.median, 0.0)))
    if noise < options.least_noise or float(np.median(np.concatenate(turns))) < options.turning * noise:
        return 0.0
    return min(options.noises * noise, options.widest)


def smoothed(
    points: Floats, axes: Floats, reach: float, tolerance: float, options: AxisSmoothingOptions = AxisSmoothingOptions()
) -> Floats:
    """Return axes (N, 3) smoothed along and across the passes, none turned by more than `tolerance` radians.

    points (N, 3): of all passes, metres. Each axis becomes that of a linear function fitted to those within `reach`
    metres (local linear regression, which has no bias at the ends of passes), on its own pass and on passes beside it,
    whose directions differ by less than 60°. Weights fall to zero towards both limits, so that no axis of a neighbour
    comes in or drops out at once. An axis beyond the tolerance is turned back to its limit. So axes at a crease keep to
    the tolerance, and noise below it vanishes.
    """
    if tolerance <= 0.0 or len(points) < 2:
        return axes
    result = axes
    for _ in range(options.rounds):
        weights = _weights(points, result, reach, options)
        mean = normalised(_fitted(weights, points, result, options.ridge * reach))
        share = np.minimum(1.0, tolerance / np.maximum(angle_between(mean, axes), 1e-300))
        result = partway(axes, mean, share)
    return result


def _fitted(weights: csr_array, points: Floats, axes: Floats, ridge: float) -> Floats:
    """Return axes (N, 3) of weighted linear regressions around points (N, 3), evaluated there. ridge: metres."""
    at = points - points.mean(axis=0)
    centre, mean = weights @ at, weights @ axes
    squares = (weights @ np.einsum("ni,nj->nij", at, at).reshape(-1, 9)).reshape(-1, 3, 3)
    mixed = (weights @ np.einsum("ni,nj->nij", axes, at).reshape(-1, 9)).reshape(-1, 3, 3)
    spread = squares - np.einsum("ni,nj->nij", centre, centre) + ridge**2 * np.eye(3)
    both = mixed - np.einsum("ni,nj->nij", mean, centre)
    return np.asarray(mean + np.einsum("nij,nj->ni", both, np.linalg.solve(spread, (at - centre)[..., None])[..., 0]))


def _weights(points: Floats, axes: Floats, reach: float, options: AxisSmoothingOptions) -> csr_array:
    """Return the matrix (N, N) of weights with the sum 1 in each row.

    They fall with the distance to zero at the reach (biweight), and with the cosine between axes to zero at `similar`.
    """
    # Dense passes, and points along them, count no more than others: of the points in a cube, the first stands for all.
    cubes = np.floor(points / (options.thinned * reach)).astype(np.int64)
    chosen = np.sort(np.unique(cubes, axis=0, return_index=True)[1])
    count = min(options.neighbours, len(chosen))
    found = nearest_points(KDTree(points[chosen]), points, k=count, distance_upper_bound=reach)
    distance, index = np.asarray(found[0]).reshape(len(points), -1), np.asarray(found[1]).reshape(len(points), -1)
    known = np.isfinite(distance)
    row = np.broadcast_to(np.arange(len(points))[:, None], distance.shape)[known]
    column, d = chosen[index[known]], distance[known]
    alike = (np.einsum("ni,ni->n", axes[row], axes[column]) - options.similar) / (1.0 - options.similar)
    similar = alike > 0.0
    own = np.flatnonzero(np.bincount(row[similar], minlength=len(points)) == 0)  # none is alike
    row, column = np.concatenate([row[similar], own]), np.concatenate([column[similar], own])
    near = 1.0 - (d[similar] / reach) ** 2
    weight = np.concatenate([np.minimum(2.0 * alike[similar], 1.0) * near * near, np.ones(len(own))])
    matrix = coo_array((weight, (row, column)), shape=(len(points), len(points))).tocsr()
    total = np.asarray(matrix.sum(axis=1)).ravel()
    return csr_array(matrix.multiply(1.0 / total[:, None]))


def rate_limited(
    points: Floats, axes: Floats, rate: float, options: AxisSmoothingOptions = AxisSmoothingOptions()
) -> Floats:
    """Return the axes (n, 3) of one pass turned by no more than `rate` radians per metre between neighbours.

    points (n, 3): of the pass, metres. Where axes turn faster, the whole pass takes the moving mean over the shortest
    width that keeps the rate; a pass that keeps it is returned unchanged. Raises ToolpathError if no mean keeps the
    rate, which only happens with opposite axes.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if len(points) < 2 or (_rates(axes, steps) <= rate).all():
        return axes
    place = np.concatenate([[0.0], np.cumsum(steps)])

    def kept(width: float) -> Floats | None:
        """Return the moving mean if it keeps the rate."""
        mean = moving_mean(place, axes, width)
        return mean if mean is not None and (_rates(mean, steps) <= rate).all() else None

    short, long = 0.0, float(np.pi / rate)
    for _ in range(options.bisections):
        result = kept(long)
        if result is not None:
            break
        short, long = long, 2.0 * long
    else:
        raise ToolpathError("no smoothing keeps the rate: opposite tool axes on one pass", key="axis_rate", value=rate)
    for _ in range(options.bisections):
        middle = 0.5 * (short + long)
        trial = kept(middle)
        if trial is None:
            short = middle
        else:
            long, result = middle, trial
    return result


def _rates(axes: Floats, steps: Floats) -> Floats:
    """Return the turn per metre (n − 1,) between neighbours, less rounding: axes at the limit keep it."""
    return angle_between(axes[1:], axes[:-1]) / np.maximum(steps, 1e-12) * (1.0 - 1e-9)


def moving_mean(place: Floats, axes: Floats, width: float) -> Floats | None:
    """Return the exact moving mean over `width` metres of axes that change linearly between places; None if it is 0."""
    # The integral of a polyline is a parabola in each step; beyond the ends the axes are constant.
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
        rows, ahead = points[a:b], result[a:b]
        ahead[1:-1] = rows[2:] - rows[:-2]
        ahead[0], ahead[-1] = rows[1] - rows[0], rows[-1] - rows[-2]
    length = np.linalg.norm(result, axis=1, keepdims=True)
    return result / np.where(length > 0.0, length, 1.0)
