"""Which place of the toolpath each moment of the program belongs to.

The program's tilt centre and axis, sampled, and the polyline of the toolpath's waypoints are matched by a monotone
relation: each waypoint gets a time, each sample a place on the interval whose waypoints enclose it in time. Between two
neighbouring events (a sample, or a waypoint's time) both sides move along straight lines, so the distance there is
at most the larger of its values at the two events. Hence the largest distance over all events bounds the Fréchet
distance of the two polylines from above, whatever the matching: soundness does not rest on the search.

The search decides whether there is a matching within the tolerances at all (`free_space_kernels`), and then looks for
the smallest largest distance that the order permits. So a good program does not look bad either.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.directions import angle_between, arc_weights
from pentapod.geometry.polyline import arc_length
from pentapod.numerics.blocks import blocks
from pentapod.verify.replay.free_space import FreeSpace, Pairing, PosedPolyline

_BLOCK = 1 << 15  # samples that are measured at once

_AXIS_SCALE_RAD = 0.05
"""Where the path turns on the spot, an axis this far off counts as much as a tilt centre off by the tolerance."""

_ALLOWED = 1.0 + 0.999e-3
"""Up to this share of the tolerance a matching is as good as within: claims allow a little more."""

_EXACT = 1e-3
"""How near, relatively, the largest distance comes to the least that the order permits."""

_WIDER = 4.0
"""Up to how many tolerances that holds. What is farther off is matched at the least sum of squares."""


@dataclass(frozen=True, eq=False)
class PathMatch:
    """A monotone matching of M samples of the program with the n waypoints of the toolpath.

    times (n,): when each waypoint is passed, in samples (2.25 is a quarter of the way from sample 2 to 3),
    non-decreasing. places (M,): the place of each sample, in waypoints, non-decreasing. arcs (M,): the same as arc
    length of the tilt centre's polyline, metres. turned (M,): how far the path's axis has turned up to there in all,
    radians. distances (M,), waypoint_distances (n,) in metres and angles (M,), waypoint_angles (n,) in radians:
    between the matched tilt centres and axes.
    """

    times: Floats
    places: Floats
    arcs: Floats
    turned: Floats
    distances: Floats
    waypoint_distances: Floats
    angles: Floats
    waypoint_angles: Floats


def match(
    motion: PosedPolyline,
    path: PosedPolyline,
    tolerance: float,
    *,
    axis_bound: float = np.pi,
    away: Floats | None = None,
) -> PathMatch:
    """Return the matching of a sampled motion with a path whose largest distance is the least that the order permits.

    Within `tolerance` metres and axes within `axis_bound` radians of each other, where that is possible; else without
    regard to the axes. away (M − 1,): metres by which the motion may be off its chords; it adds to the distances.
    Beyond a few tolerances the matching has the least sum of squared distances instead, in order.
    """
    turning = turns_on_spot(path, tolerance)
    off = np.zeros(len(motion.points) - 1) if away is None else np.where(np.isfinite(away), away, 0.0)
    near_turn = np.append(turning, False) | np.append(False, turning)
    scale = (tolerance / _AXIS_SCALE_RAD) ** 2
    weights = (np.where(turning, scale, 0.0), np.where(near_turn, scale, 0.0), (_ALLOWED * tolerance) ** 2)
    space = FreeSpace(motion, path, weights, off, axis_bound)

    def measured(pairing: Pairing) -> PathMatch:
        return _measure(motion, path, pairing, _places(motion, path, turning, tolerance, pairing))

    for radius, by_axis in ((_ALLOWED * tolerance, True), (_ALLOWED * tolerance, False), (_WIDER * tolerance, False)):
        pairing = space.pairing(radius, by_axis=by_axis)
        if pairing is not None:
            return _least(space, pairing, measured, radius, by_axis=by_axis)
    return measured(space.patched(_WIDER * tolerance) or space.by_arc_length())


def _least(
    space: FreeSpace, pairing: Pairing, measured: Callable[[Pairing], PathMatch], radius: float, *, by_axis: bool
) -> PathMatch:
    """Return the matching with the least largest distance, beginning with a pairing within some radius, metres."""

    def largest(pairing: Pairing, match: PathMatch) -> float:
        return space.largest(pairing, match.distances, match.waypoint_distances)

    best = measured(pairing)
    low, high = pairing.least, largest(pairing, best)
    trial = low * (1.0 + _EXACT)
    while high > low * (1.0 + _EXACT) and high > _EXACT * radius:
        found = space.pairing(trial, by_axis=by_axis, more=radius - trial)
        if found is None:
            low = trial
        else:
            best = measured(found)
            low, high = max(low, found.least), min(trial, largest(found, best))
        trial = 0.5 * (low + high)
    return best


def _places(motion: PosedPolyline, path: PosedPolyline, turning: Bools, tolerance: float, pairing: Pairing) -> Floats:
    """Return the place (M,) of each sample: the closest on its interval that keeps order and radius."""
    places, interval = np.empty(len(motion.points)), pairing.intervals
    for part in blocks(len(places), _BLOCK):
        own = PosedPolyline(motion.points[part], motion.axes[part])
        places[part] = interval[part] + interval_fractions(own, path, turning, tolerance, interval[part])
    return pairing.ordered_places(places)


def turns_on_spot(path: PosedPolyline, tolerance: float) -> Bools:
    """Return the intervals (n − 1,) on which the axis turns while the tilt centre (as good as) stands."""
    length = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    turn = np.linalg.norm(np.diff(path.axes, axis=0), axis=1)
    return (length <= tolerance) & (turn * tolerance >= _AXIS_SCALE_RAD * length) & (turn > 1e-12)


def _measure(motion: PosedPolyline, path: PosedPolyline, pairing: Pairing, places: Floats) -> PathMatch:
    """Return the matching that has these times (n,) and places (M,), measured."""
    times = pairing.times
    turns = angle_between(path.axes[:-1], path.axes[1:])
    distances, angles = np.empty(len(places)), np.empty(len(places))
    for part in blocks(len(places), _BLOCK):
        points, axes = pose_at(path, turns, places[part])
        distances[part] = np.linalg.norm(motion.points[part] - points, axis=1)
        angles[part] = angle_between(motion.axes[part], axes)
    chord = np.minimum(times.astype(np.intp), len(motion.points) - 2)
    at = (times - chord)[:, None]
    visited = motion.points[chord] * (1.0 - at) + motion.points[chord + 1] * at
    pointed = motion.axes[chord] * (1.0 - at) + motion.axes[chord + 1] * at
    waypoints = np.arange(len(path.points))
    return PathMatch(
        times=times,
        places=places,
        arcs=np.interp(places, waypoints, arc_length(path.points)),
        turned=np.interp(places, waypoints, np.concatenate([[0.0], np.cumsum(turns)])),
        distances=distances,
        waypoint_distances=np.linalg.norm(visited - path.points, axis=1),
        angles=angles,
        waypoint_angles=angle_between(pointed, path.axes),
    )


def interval_fractions(
    motion: PosedPolyline, path: PosedPolyline, turning: Bools, tolerance: float, interval: Ints
) -> Floats:
    """Return how far along its interval, in [0, 1], each sample is: by its tilt centre, or its axis on the spot."""
    step = np.diff(path.points, axis=0)
    square = np.einsum("ij,ij->i", step, step)
    off = motion.points - path.points[interval]
    along, length = np.einsum("ij,ij->i", off, step[interval]), square[interval]
    along = np.clip(np.divide(along, length, out=np.zeros_like(along), where=length > 0.0), 0.0, 1.0)
    spot = np.flatnonzero(turning[interval])
    if len(spot):
        k = interval[spot]
        turned, turn = _arc_fraction(motion.axes[spot], path.axes[k], path.axes[k + 1])
        by_tilt_centre, by_axis = square[k] / tolerance**2, (turn / _AXIS_SCALE_RAD) ** 2
        along[spot] = (by_tilt_centre * along[spot] + by_axis * turned) / (by_tilt_centre + by_axis)
    return along


def _arc_fraction(axes: Floats, first: Floats, second: Floats) -> tuple[Floats, Floats]:
    """Return how far in [0, 1] each axis (P, 3) is along the great arc from first to second; and the arc."""
    angle = angle_between(first, second)
    cosine = np.einsum("ij,ij->i", first, second)[:, None]
    across = second - cosine * first
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
    turned = np.arctan2(np.einsum("ij,ij->i", axes, across), np.einsum("ij,ij->i", axes, first))
    return np.clip(turned / angle, 0.0, 1.0), angle


def pose_at(path: PosedPolyline, turns: Floats, places: Floats) -> tuple[Floats, Floats]:
    """Return points (M, 3), linear, and axes (M, 3), along great arcs, of the path at these places.

    turns (n − 1,): the angles of those arcs.
    """
    k = np.minimum(places.astype(np.intp), len(path.points) - 2)
    f = places - k
    points = path.points[k] * (1.0 - f)[:, None] + path.points[k + 1] * f[:, None]
    a, b = arc_weights(turns[k], f)
    return points, a[:, None] * path.axes[k] + b[:, None] * path.axes[k + 1]
