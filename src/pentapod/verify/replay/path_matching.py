"""Monotone matching of the program with the toolpath: which place of the path each moment belongs to.

The program's tilt centre and axis, sampled, and the polyline of the toolpath's waypoints are matched by a monotone
relation: each waypoint gets a time, each sample a place on the interval whose waypoints enclose it in time. Between two
neighbouring events (a sample, or a waypoint's time) both sides move along straight lines, so the distance there is
at most the larger of its values at the two events. Hence the largest distance over all events bounds the Fréchet
distance of the two polylines from above, whatever the matching: soundness does not rest on the search.

The search decides whether there is a matching within the tolerances at all (`free_space_kernels`), and then minimises
the largest distance. So a good program is not judged to be bad either.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints, row_lengths
from pentapod.geometry.directions import angle_between, arc_weights
from pentapod.geometry.polyline import arc_length
from pentapod.numerics.blocks import blocks
from pentapod.verify.replay.free_space import FreeSpace, FreeSpaceOptions, Pairing, PosedPolyline


@dataclass(frozen=True)
class MatchOptions:
    """Options of the matching.

    within: share of the tolerance up to which a matching is within it; claims allow a little more. precision: relative,
    of the smallest largest distance, which is searched for up to `wide` tolerances; beyond, the sum of squares is
    minimised instead. axis_scale: radians; where the path turns on the spot, an axis this far off counts as much as a
    tilt centre off by the tolerance.
    """

    within: float = 1.0 + 0.999e-3
    precision: float = 1e-3
    wide: float = 4.0
    axis_scale: float = 0.05
    search: FreeSpaceOptions = field(default_factory=FreeSpaceOptions)


OPTIONS = MatchOptions()


@dataclass(frozen=True, eq=False)
class AtPlaces:
    """Numbers at places (M,) of the path, from those at its waypoints (n,); computed where they are asked for."""

    places: Floats
    of_waypoints: Floats

    def __len__(self) -> int:
        return len(self.places)

    def __getitem__(self, rows: slice | Ints | int) -> Floats:
        """Return the numbers at some of the places."""
        places, values = self.places[rows], self.of_waypoints
        k = np.minimum(places.astype(np.intp), len(values) - 2)
        return np.asarray((values[k + 1] - values[k]) * (places - k) + values[k])


@dataclass(frozen=True, eq=False)
class PathMatch:
    """A monotone matching of M samples of the program with the n waypoints of the toolpath.

    times (n,): when each waypoint is passed, in samples (2.25 is a quarter of the way from sample 2 to 3),
    non-decreasing. places (M,): the place of each sample, in waypoints, non-decreasing. waypoint_arcs (n,): arc length
    of the tilt centre's polyline up to there, metres; waypoint_turned (n,): how far the path's axis turns up to there,
    radians; `arcs` and `turned` are those of samples. distances (M,), waypoint_distances (n,) in metres and angles
    (M,), waypoint_angles (n,) in radians: between the matched tilt centres and axes.
    """

    times: Floats
    places: Floats
    waypoint_arcs: Floats
    waypoint_turned: Floats
    distances: Floats
    waypoint_distances: Floats
    angles: Floats
    waypoint_angles: Floats

    @property
    def arcs(self) -> AtPlaces:
        """Arc length of the path up to each sample, metres."""
        return AtPlaces(self.places, self.waypoint_arcs)

    @property
    def turned(self) -> AtPlaces:
        """How far the path's axis turns up to each sample, radians."""
        return AtPlaces(self.places, self.waypoint_turned)


def match(
    motion: PosedPolyline,
    path: PosedPolyline,
    tolerance: float,
    *,
    axis_bound: float = np.pi,
    chord_deviations: Floats | None = None,
    options: MatchOptions = OPTIONS,
) -> PathMatch:
    """Return the monotone matching of a sampled motion with a path that minimises the largest distance.

    Within `tolerance` metres and axes within `axis_bound` radians of each other, where that is possible; else without
    regard to the axes. chord_deviations (M − 1,): bounds in metres on the deviation of the motion from its chords; they
    add to the distances. Where the motion is farther off, the matching minimises the sum of squared distances instead.
    """
    turning = turns_on_spot(path, tolerance, options)
    deviations = np.zeros(len(motion.points) - 1) if chord_deviations is None else chord_deviations
    near_turn = np.append(turning, False) | np.append(False, turning)
    scale, within, wide = (tolerance / options.axis_scale) ** 2, options.within * tolerance, options.wide * tolerance
    weights = (np.where(turning, scale, 0.0), np.where(near_turn, scale, 0.0), within**2)
    if not (finite := np.isfinite(deviations)).all():
        deviations = np.where(finite, deviations, 0.0)
    space = FreeSpace(motion, path, weights, deviations, axis_bound, options.search)

    def measured(pairing: Pairing) -> PathMatch:
        return _measure(motion, path, pairing, _places(motion, path, turning, tolerance, pairing, options), options)

    for radius, by_axis in ((within, True), (within, False), (wide, False)):
        found = _least(space, measured, radius, by_axis=by_axis, precision=options.precision)
        if found is not None:
            return found
    return measured(space.patched(wide) or space.by_arc_length())


def _least(
    space: FreeSpace, measured: Callable[[Pairing], PathMatch], radius: float, *, by_axis: bool, precision: float
) -> PathMatch | None:
    """Return the matching within a radius, metres, with the smallest largest distance, by bisection; None without one.

    Of a long program a pairing takes much memory, so none is kept.
    """

    def largest(pairing: Pairing, match: PathMatch) -> float:
        return space.largest(pairing, match.distances, match.waypoint_distances)

    if (found := space.pairing(radius, by_axis=by_axis)) is None:
        return None
    best = measured(found)
    low, high = found.least, largest(found, best)
    trial = low * (1.0 + precision)
    while high > low * (1.0 + precision) and high > precision * radius:
        del found
        found = space.pairing(trial, by_axis=by_axis, more=radius - trial)
        if found is None:
            low = trial
        else:
            best = measured(found)
            low, high = max(low, found.least), min(trial, largest(found, best))
        trial = 0.5 * (low + high)
    return best


def _places(
    motion: PosedPolyline,
    path: PosedPolyline,
    turning: Bools,
    tolerance: float,
    pairing: Pairing,
    options: MatchOptions,
) -> Floats:
    """Return the place (M,) of each sample: the closest on its interval that keeps order and radius."""
    places, interval = np.empty(len(motion.points)), pairing.intervals
    for part in blocks(len(places), options.search.at_once):
        own = PosedPolyline(motion.points[part], motion.axes[part])
        places[part] = interval[part] + interval_fractions(own, path, turning, tolerance, interval[part], options)
    return pairing.ordered_places(places)


def turns_on_spot(path: PosedPolyline, tolerance: float, options: MatchOptions = OPTIONS) -> Bools:
    """Return the intervals (n − 1,) on which the axis turns while the tilt centre hardly moves."""
    length = row_lengths(np.diff(path.points, axis=0))
    turn = row_lengths(np.diff(path.axes, axis=0))
    return (length <= tolerance) & (turn * tolerance >= options.axis_scale * length) & (turn > 1e-12)


def _measure(
    motion: PosedPolyline, path: PosedPolyline, pairing: Pairing, places: Floats, options: MatchOptions
) -> PathMatch:
    """Return the matching with these places (M,), and its distances and angles."""
    times = pairing.times
    turns = angle_between(path.axes[:-1], path.axes[1:])
    distances, angles = np.empty(len(places)), np.empty(len(places))
    for part in blocks(len(places), options.search.at_once):
        points, axes = pose_at(path, turns, places[part])
        distances[part] = row_lengths(motion.points[part] - points)
        angles[part] = angle_between(motion.axes[part], axes)
    chord = np.minimum(times.astype(np.intp), len(motion.points) - 2)
    at = (times - chord)[:, None]
    pointed = motion.axes[chord] * (1.0 - at) + motion.axes[chord + 1] * at
    return PathMatch(
        times=times,
        places=places,
        waypoint_arcs=arc_length(path.points),
        waypoint_turned=np.concatenate([[0.0], np.cumsum(turns)]),
        distances=distances,
        waypoint_distances=row_lengths(points_at(motion.points, times) - path.points),
        angles=angles,
        waypoint_angles=angle_between(pointed, path.axes),
    )


def interval_fractions(
    motion: PosedPolyline,
    path: PosedPolyline,
    turning: Bools,
    tolerance: float,
    interval: Ints,
    options: MatchOptions = OPTIONS,
) -> Floats:
    """Return the fraction in [0, 1] of its interval at which each sample is: by tilt centre, in turns by axis too."""
    step = np.diff(path.points, axis=0)
    square = np.einsum("ij,ij->i", step, step)
    off = motion.points - path.points[interval]
    along, length = np.einsum("ij,ij->i", off, step[interval]), square[interval]
    along = np.clip(np.divide(along, length, out=np.zeros_like(along), where=length > 0.0), 0.0, 1.0)
    spot = np.flatnonzero(turning[interval])
    if len(spot):
        k = interval[spot]
        turned, turn = _arc_fraction(motion.axes[spot], path.axes[k], path.axes[k + 1])
        by_tilt_centre, by_axis = square[k] / tolerance**2, (turn / options.axis_scale) ** 2
        along[spot] = (by_tilt_centre * along[spot] + by_axis * turned) / (by_tilt_centre + by_axis)
    return along


def _arc_fraction(axes: Floats, first: Floats, second: Floats) -> tuple[Floats, Floats]:
    """Return the fraction in [0, 1] of the great arc from first to second at which each axis (P, 3) is, and the arc."""
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
    a, b = arc_weights(turns[k], places - k)
    return points_at(path.points, places), a[:, None] * path.axes[k] + b[:, None] * path.axes[k + 1]


def points_at(points: Floats, places: Floats) -> Floats:
    """Return the points (M, 3) at these places of a polyline (n, 3)."""
    k = np.minimum(places.astype(np.intp), len(points) - 2)
    f = (places - k)[:, None]
    return points[k] * (1.0 - f) + points[k + 1] * f
