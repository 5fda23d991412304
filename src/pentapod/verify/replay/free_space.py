"""Whether a motion follows a path within a radius, in order, and where it passes which waypoint."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.directions import angle_between
from pentapod.geometry.polyline import arc_length

_MOST_CELLS = 150_000_000
"""Cells of the free-space diagram that one search may look at: five bytes each, and about ten seconds."""

_ROUNDS, _WINDOW = 40, 32
"""Of the search that widens the radius where the motion leaves the path; and how wide, in samples, at first."""


@dataclass(frozen=True, eq=False)
class PosedPolyline:
    """A polyline in space and direction: points (n, 3) metres, axes (n, 3) unit."""

    points: Floats
    axes: Floats


@dataclass(frozen=True, eq=False)
class Pairing:
    """A monotone matching of M samples with n waypoints, up to the places within the intervals.

    intervals (M,): of the path, that each sample belongs to. lowest, highest (M,): from where to where, in waypoints,
    its place keeps order and radius. times (n,): when each waypoint is passed, in samples. least: metres; no matching
    of those that were searched has a smaller largest distance.
    """

    intervals: Ints
    lowest: Floats
    highest: Floats
    times: Floats
    least: float

    def ordered_places(self, wanted: Floats) -> Floats:
        """Return places (M,) in order, within the bounds, near the wanted ones."""
        return _ordered(wanted, self.lowest, self.highest)


class FreeSpace:
    """The free-space diagram of a motion and a path: which places of one are near which places of the other."""

    def __init__(
        self,
        motion: PosedPolyline,
        path: PosedPolyline,
        weights: tuple[Floats, Floats, float],
        away: Floats,
        axis_bound: float,
    ) -> None:
        """weights: m², of squared turns beside squared distances, of intervals (n − 1,) and waypoints (n,).

        And m², the squared distance beyond which as few samples and waypoints as possible should be.
        away (M − 1,): metres by which the motion may be off its chords. axis_bound: radians, where axes count.
        """
        self.away = away
        self._motion, self._path = _curve(motion), _curve(path)
        self._weights = weights
        # Chords between unit vectors are as much shorter than the arc as it is high.
        high = angle_between(path.axes[:-1], path.axes[1:]) ** 2 / 8.0
        self._turns = (2.0 * np.sin(0.5 * min(axis_bound, np.pi)) + high) ** 2
        self._samples, self._waypoints = len(motion.points), len(path.points)

    def pairing(self, radius: float, *, by_axis: bool, more: float = 0.0) -> Pairing | None:
        """Return a matching within the radius, metres, at the least sum of squared distances; None: there is none.

        by_axis: also within the bound of the axes. more: metres, for the radius where axes have a weight. None as well
        where too much is near everything to be searched.
        """
        return self._search(np.full(self._samples - 1, radius), by_axis=by_axis, more=more)[1]

    def largest(self, pairing: Pairing, distances: Floats, waypoint_distances: Floats) -> float:
        """Return the largest of distances (M,) and (n,), with what the motion may be off its chords.

        Without those where axes have a weight: there the nearest place is not the best one.
        """
        chord = np.minimum(pairing.times.astype(np.intp), len(self.away) - 1)
        at_samples = np.maximum(np.append(self.away, 0.0), np.append(0.0, self.away))
        samples, waypoints = self._weights[0][pairing.intervals] == 0.0, self._weights[1] == 0.0
        samples[[0, -1]] = waypoints[[0, -1]] = True
        return float(
            max(
                (distances + at_samples)[samples].max(),
                (waypoint_distances + self.away[chord])[waypoints].max(),
            )
        )

    def patched(self, radius: float) -> Pairing | None:
        """Return a matching within the radius but where the motion leaves the path: there within what it takes.

        None where that would need too much memory.
        """
        radii, wide, window, last = np.full(self._samples - 1, radius), radius, _WINDOW, -1
        for _ in range(_ROUNDS):
            reached, found = self._search(radii, by_axis=False)
            if found is not None or reached < 0:
                return found
            # Where the search got on, the stretch is longer; where it did not, the motion is farther off.
            window *= 2
            wide = wide if reached > last + window // 4 else 4.0 * wide
            near = slice(max(reached - window, 0), reached + window)
            radii[near] = np.maximum(radii[near], wide)
            last = reached
        return None

    def by_arc_length(self) -> Pairing:
        """Return the matching by the fraction of the way: for motions that no search can match."""
        way, arc = arc_length(self._motion[0]), arc_length(self._path[0])
        samples, waypoints = np.arange(float(self._samples)), np.arange(float(self._waypoints))
        times = np.interp(arc * way[-1], way * arc[-1], samples)
        times[[0, -1]] = 0.0, self._samples - 1.0
        intervals = np.clip(np.searchsorted(times, samples, side="right") - 1, 0, self._waypoints - 2)
        lowest, highest = waypoints[intervals], waypoints[intervals + 1]
        highest[0], lowest[-1] = 0.0, waypoints[-1]
        return Pairing(intervals, lowest, highest, times, 0.0)

    def _search(self, radii: Floats, *, by_axis: bool, more: float = 0.0) -> tuple[int, Pairing | None]:
        """Return how many samples can be reached within radii (M − 1,), and the matching if all can; −1: too many."""
        from pentapod.verify.replay import free_space_kernels as kernels  # noqa: PLC0415  compiled: only where used

        near = radii - self.away
        at_samples = np.minimum(np.append(near, np.inf), np.append(np.inf, near))
        bounds = (near, at_samples, more, self._turns if by_axis else np.full(len(self._turns), np.inf))
        reached, routed, spare, cells = kernels.walk(self._motion, self._path, bounds, self._weights, _MOST_CELLS)
        if reached < self._samples:
            return reached, None
        intervals, chords = np.empty(self._samples, dtype=np.intp), np.empty(self._waypoints, dtype=np.intp)
        kernels.trace(cells, routed, intervals, chords)
        sides = np.empty((self._samples + self._waypoints, 3))
        kernels.free_sides(self._motion, self._path, bounds, self._weights, intervals, chords, sides)
        samples, waypoints = sides[: self._samples, :2] + intervals[:, None], sides[self._samples :] + chords[:, None]
        # The matching begins and ends with both curves.
        samples[0], samples[-1] = 0.0, self._waypoints - 1.0
        waypoints[0], waypoints[-1] = 0.0, self._samples - 1.0
        times = _ordered(waypoints[:, 2], waypoints[:, 0], waypoints[:, 1])
        return reached, Pairing(intervals, samples[:, 0], samples[:, 1], times, max(float(radii.max()) + spare, 0.0))


def _curve(line: PosedPolyline) -> tuple[Floats, Floats]:
    """Return points and axes as kernels take them: in one piece and, by their type, not read-only."""
    return np.require(line.points, np.float64, ["C", "W"]), np.require(line.axes, np.float64, ["C", "W"])


def _ordered(wanted: Floats, lowest: Floats, highest: Floats) -> Floats:
    """Return values in order within bounds that permit one, near the wanted ones."""
    late, early = np.maximum.accumulate(wanted), np.minimum.accumulate(wanted[::-1])[::-1]
    low, high = np.maximum.accumulate(lowest), np.minimum.accumulate(highest[::-1])[::-1]
    return np.clip(0.5 * (late + early), low, np.maximum(low, high))
