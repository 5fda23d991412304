"""Which place of the toolpath each moment of the program belongs to.

The program's pivot, sampled, and the polyline of the toolpath's pivots are matched by a monotone relation:
each waypoint gets a time (`visits`), each sample a place on the interval whose waypoints enclose it in time.
Between two neighbouring events (a sample, or a waypoint's visit) both sides move along straight lines, so the
distance there is at most the larger of its values at the two events. Hence the largest distance over all
events bounds the Fréchet distance of the two polylines from above, whatever the matching: a bad proposal can
only make a good program look bad, never the reverse.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.arrays import Bools, Floats, Ints
from pentapod.geometry.directions import angle_between, arc_weights
from pentapod.geometry.polyline import arc_length
from pentapod.kinematics.blocks import blocks
from pentapod.verify.visits import Course, Visits, find_visits

_BLOCK = 1 << 15  # samples that are measured at once

# Where the path turns on the spot, an axis this far off counts as much as a pivot off by the tolerance.
_AXIS_SCALE_RAD = 0.05
# Radii of the search, in path tolerances. The first finds a good program; the others find what to say about
# a bad one: where it leaves the toolpath, and how far.
_RADII = (1.05, 0.3, 8.0, 60.0)


@dataclass(frozen=True, eq=False)
class Match:
    """A monotone matching of M samples of the program with the n waypoints of the toolpath.

    times (n,): when each waypoint is visited, in samples. missed (n,): not passed in order, at any search
    radius tried. places (M,): the place of each sample, in waypoints (2.25 is a quarter of the way from
    waypoint 2 to 3), non-decreasing. arcs (M,): the same as arc length of the pivot's polyline, metres.
    turned (M,): how far the path's axis has turned up to there in all, radians.
    distances (M,), waypoint_distances (n,) in metres and angles (M,), waypoint_angles (n,) in radians:
    between the matched pivots and axes.
    """

    times: Floats
    missed: Bools
    places: Floats
    arcs: Floats
    turned: Floats
    distances: Floats
    waypoint_distances: Floats
    angles: Floats
    waypoint_angles: Floats


def match(motion: Course, path: Course, tolerance: float) -> Match:
    """Return the matching of a sampled motion with a path, closest where within `tolerance` metres."""
    arc = arc_length(path.points)
    turning = _turning(path, tolerance)
    near_turn = np.append(turning, False) | np.append(False, turning)
    weight = np.where(near_turn, (tolerance / _AXIS_SCALE_RAD) ** 2, 0.0)
    best: Match | None = None
    least = (np.inf, np.inf)
    for radius in _RADII:
        visits = find_visits(motion, path, arc, radius * tolerance, weight)
        if visits is None:
            continue
        found = _measure(motion, path, visits, _places(motion, path, turning, tolerance, visits.times))
        distances = np.concatenate([found.distances, found.waypoint_distances])
        farther = int((distances > tolerance).sum())
        if (farther, float(distances.max())) < least:
            best, least = found, (farther, float(distances.max()))
        if not farther:
            break
    if best is None:
        visits = Visits(_by_arc_length(motion.points, arc), np.ones(len(arc), dtype=np.bool_))
        best = _measure(motion, path, visits, _places(motion, path, turning, tolerance, visits.times))
    return best


def _places(motion: Course, path: Course, turning: Bools, tolerance: float, times: Floats) -> Floats:
    """Return the place (M,) of each sample, from the visits (n,) of the waypoints."""
    interval = np.searchsorted(times, np.arange(len(motion.points)), side="right") - 1
    interval = np.clip(interval, 0, len(times) - 2)
    places = np.empty(len(interval))
    for part in blocks(len(interval), _BLOCK):
        own = Course(motion.points[part], motion.axes[part])
        places[part] = interval[part] + _fractions(own, path, turning, tolerance, interval[part])
    # The matching begins and ends with both curves, and never turns back.
    places[0], places[-1] = 0.0, len(times) - 1.0
    late, early = np.maximum.accumulate(places), np.minimum.accumulate(places[::-1])[::-1]
    return 0.5 * (late + early)


def _turning(path: Course, tolerance: float) -> Bools:
    """Return the intervals (n − 1,) on which the axis turns while the pivot (as good as) stands."""
    length = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    turn = np.linalg.norm(np.diff(path.axes, axis=0), axis=1)
    return (length <= tolerance) & (turn * tolerance >= _AXIS_SCALE_RAD * length) & (turn > 1e-12)


def _by_arc_length(samples: Floats, arc: Floats) -> Floats:
    """Return visits (n,) by the fraction of the way: for motions that no search can match."""
    way = arc_length(samples)
    return np.interp(arc * way[-1], way * arc[-1], np.arange(len(way), dtype=np.float64))


def _measure(motion: Course, path: Course, visits: Visits, places: Floats) -> Match:
    """Return the matching that has these visits (n,) and places (M,), measured."""
    times = visits.times
    turns = angle_between(path.axes[:-1], path.axes[1:])
    distances, angles = np.empty(len(places)), np.empty(len(places))
    for part in blocks(len(places), _BLOCK):
        points, axes = _at(path, turns, places[part])
        distances[part] = np.linalg.norm(motion.points[part] - points, axis=1)
        angles[part] = angle_between(motion.axes[part], axes)
    chord = np.minimum(times.astype(np.intp), len(motion.points) - 2)
    at = (times - chord)[:, None]
    visited = motion.points[chord] * (1.0 - at) + motion.points[chord + 1] * at
    pointed = motion.axes[chord] * (1.0 - at) + motion.axes[chord + 1] * at
    waypoints = np.arange(len(path.points))
    return Match(
        times=times,
        missed=visits.missed,
        places=places,
        arcs=np.interp(places, waypoints, arc_length(path.points)),
        turned=np.interp(places, waypoints, np.concatenate([[0.0], np.cumsum(turns)])),
        distances=distances,
        waypoint_distances=np.linalg.norm(visited - path.points, axis=1),
        angles=angles,
        waypoint_angles=angle_between(pointed, path.axes),
    )


def _fractions(motion: Course, path: Course, turning: Bools, tolerance: float, interval: Ints) -> Floats:
    """Return how far along its interval, in [0, 1], each sample is: by its pivot, or its axis on the spot."""
    step = np.diff(path.points, axis=0)
    square = np.einsum("ij,ij->i", step, step)
    off = motion.points - path.points[interval]
    along, length = np.einsum("ij,ij->i", off, step[interval]), square[interval]
    along = np.clip(np.divide(along, length, out=np.zeros_like(along), where=length > 0.0), 0.0, 1.0)
    spot = np.flatnonzero(turning[interval])
    if len(spot):
        k = interval[spot]
        turned, turn = _arc_fraction(motion.axes[spot], path.axes[k], path.axes[k + 1])
        by_pivot, by_axis = square[k] / tolerance**2, (turn / _AXIS_SCALE_RAD) ** 2
        along[spot] = (by_pivot * along[spot] + by_axis * turned) / (by_pivot + by_axis)
    return along


def _arc_fraction(axes: Floats, first: Floats, second: Floats) -> tuple[Floats, Floats]:
    """Return how far in [0, 1] each axis (P, 3) is along the great arc from first to second; and the arc."""
    angle = angle_between(first, second)
    cosine = np.einsum("ij,ij->i", first, second)[:, None]
    across = second - cosine * first
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
    turned = np.arctan2(np.einsum("ij,ij->i", axes, across), np.einsum("ij,ij->i", axes, first))
    return np.clip(turned / angle, 0.0, 1.0), angle


def _at(path: Course, turns: Floats, places: Floats) -> tuple[Floats, Floats]:
    """Return points (M, 3), linear, and axes (M, 3), along great arcs, of the path at these places.

    turns (n − 1,): the angles of those arcs.
    """
    k = np.minimum(places.astype(np.intp), len(path.points) - 2)
    f = places - k
    points = path.points[k] * (1.0 - f)[:, None] + path.points[k + 1] * f[:, None]
    a, b = arc_weights(turns[k], f)
    return points, a[:, None] * path.axes[k] + b[:, None] * path.axes[k + 1]
