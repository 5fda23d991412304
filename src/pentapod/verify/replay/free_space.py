"""Free-space diagram of a motion and a path (Alt and Godau 1995): monotone matchings within a radius."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.directions import angle_between
from pentapod.geometry.polyline import arc_length
from pentapod.numerics.blocks import blocks


@dataclass(frozen=True)
class FreeSpaceOptions:
    """Limits of a search in the free-space diagram.

    cells: that one search may look at, of five bytes each; a million take about a second. rounds, window: of the
    search that widens the radius where the motion leaves the path: how often, and how many samples at first. In all
    these rounds it may look at `widened` cells, and `each` more for each sample. at_once: samples that are measured
    together.
    """

    cells: int = 150_000_000
    widened: int = 10_000_000
    each: int = 16
    rounds: int = 40
    window: int = 32
    at_once: int = 1 << 15


@dataclass(frozen=True, eq=False)
class PosedPolyline:
    """A polyline in space and direction: points (n, 3) metres, axes (n, 3) unit."""

    points: Floats
    axes: Floats


@dataclass(frozen=True, eq=False)
class Pairing:
    """A monotone matching of M samples with n waypoints, up to the places within the intervals.

    intervals (M,): of the path, that each sample belongs to. lowest, highest (M,): range of places, in waypoints, that
    keep order and radius. times (n,): when each waypoint is passed, in samples. least: metres, a lower bound on the
    largest distance of the matchings that were searched.
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
    """The free-space diagram of a motion and a path: which places of one are close to which places of the other."""

    def __init__(
        self,
        motion: PosedPolyline,
        path: PosedPolyline,
        weights: tuple[Floats, Floats, float],
        deviations: Floats,
        axis_bound: float,
        options: FreeSpaceOptions,
    ) -> None:
        """weights: see `free_space_kernels.Weights`.

        deviations (M − 1,): bounds in metres on the deviation of the motion from its chords. axis_bound: radians, where
        axes count.
        """
        self._deviations, self._options = deviations, options
        self._motion, self._path = _curve(motion), _curve(path)
        self._weights = weights
        # Chords between unit vectors are as much shorter than the arc as it is high.
        high = angle_between(path.axes[:-1], path.axes[1:]) ** 2 / 8.0
        self._turns = (2.0 * np.sin(0.5 * min(axis_bound, np.pi)) + high) ** 2
        self._samples, self._waypoints = len(motion.points), len(path.points)

    def pairing(self, radius: float, *, by_axis: bool, more: float = 0.0) -> Pairing | None:
        """Return the matching within the radius, metres, with the least sum of squared distances.

        None where there is none, or the diagram is too large. by_axis: also within the bound of the axes. more: metres
        added to the radius where axes have a weight.
        """
        return self._search(radius, by_axis=by_axis, more=more)[-1]

    def largest(self, pairing: Pairing, distances: Floats, waypoint_distances: Floats) -> float:
        """Return the largest of distances (M,) and (n,), each with the deviation of the motion from its chord.

        Without those where axes have a weight: there the nearest place is not the best one.
        """
        chord = np.minimum(pairing.times.astype(np.intp), len(self._deviations) - 1)
        weighs, waypoints = self._weights[0] != 0.0, self._weights[1] == 0.0
        waypoints[[0, -1]] = True
        most = float((waypoint_distances + self._deviations[chord])[waypoints].max())
        last = len(distances) - 1
        for part in blocks(len(distances), self._options.at_once):
            rows = np.arange(part.start, part.stop)
            beside = self._deviations[np.maximum(rows - 1, 0)], self._deviations[np.minimum(rows, last - 1)]
            counts = ~weighs[pairing.intervals[part]] | (rows == 0) | (rows == last)
            at_samples = np.maximum(*beside) + distances[part]
            most = max(most, float(at_samples.max(where=counts, initial=-np.inf)))
        return most

    def patched(self, radius: float) -> Pairing | None:
        """Return a matching within the radius, which is widened where the motion leaves the path.

        None where that would need too many cells.
        """
        radii, wide, window, last = np.full(self._samples - 1, radius), radius, self._options.window, -1
        left = self._options.widened + self._options.each * self._samples
        for _ in range(self._options.rounds):
            reached, cells, found = self._search(radii, by_axis=False, most=left)
            left -= cells
            if found is not None or reached < 0 or left <= 0:
                return found
            # Where the search advanced, the window is too short; where it did not, the radius is too small.
            window *= 2
            wide = wide if reached > last + window // 4 else 4.0 * wide
            near = slice(max(reached - window, 0), reached + window)
            radii[near] = np.maximum(radii[near], wide)
            last = reached
        return None

    def by_arc_length(self) -> Pairing:
        """Return the matching by the fraction of arc length, for motions that no search can match."""
        travelled, arc = arc_length(self._motion[0]), arc_length(self._path[0])
        samples, waypoints = np.arange(float(self._samples)), np.arange(float(self._waypoints))
        times = np.interp(arc * travelled[-1], travelled * arc[-1], samples)
        times[[0, -1]] = 0.0, self._samples - 1.0
        intervals = np.clip(np.searchsorted(times, samples, side="right") - 1, 0, self._waypoints - 2)
        lowest, highest = waypoints[intervals], waypoints[intervals + 1]
        highest[0], lowest[-1] = 0.0, waypoints[-1]
        return Pairing(intervals, lowest, highest, times, 0.0)

    def _search(
        self, radii: Floats | float, *, by_axis: bool, more: float = 0.0, most: int | None = None
    ) -> tuple[int, int, Pairing | None]:
        """Return how many samples are reached within radii (M − 1,), how many cells were looked at, and the matching.

        One radius stands for all. most: cells to be looked at; for more −1 samples are reached. The matching is None
        unless all samples are reached.
        """
        from pentapod.verify.replay import free_space_kernels as kernels  # noqa: PLC0415  compiled: only where used

        near = radii - self._deviations
        at_samples = np.append(near, np.inf)
        np.minimum(at_samples[1:], near, out=at_samples[1:])
        bounds = (near, at_samples, more, self._turns if by_axis else np.full(len(self._turns), np.inf))
        most = self._options.cells if most is None else min(most, self._options.cells)
        reached, routed, spare, cells = kernels.walk(self._motion, self._path, bounds, self._weights, most)
        count = int(cells[0].max())
        if reached < self._samples:
            return reached, count, None
        intervals, chords = np.empty(self._samples, dtype=np.intp), np.empty(self._waypoints, dtype=np.intp)
        kernels.trace(cells, routed, intervals, chords)
        del cells  # as large as what is made now
        samples, waypoints = np.empty((self._samples, 2)), np.empty((self._waypoints, 3))
        kernels.free_sides(self._motion, self._path, bounds, self._weights, intervals, chords, samples, waypoints)
        samples += intervals[:, None]
        waypoints += chords[:, None]
        # The matching begins and ends with both curves.
        samples[0], samples[-1] = 0.0, self._waypoints - 1.0
        waypoints[0], waypoints[-1] = 0.0, self._samples - 1.0
        times = _ordered(waypoints[:, 2], waypoints[:, 0], waypoints[:, 1])
        least = max(float(np.max(radii)) + spare, 0.0)
        return reached, count, Pairing(intervals, samples[:, 0], samples[:, 1], times, least)


def _curve(line: PosedPolyline) -> tuple[Floats, Floats]:
    """Return points and axes as the kernels take them: contiguous and, by their type, writable."""
    return np.require(line.points, np.float64, ["C", "W"]), np.require(line.axes, np.float64, ["C", "W"])


def _ordered(wanted: Floats, lowest: Floats, highest: Floats) -> Floats:
    """Return values in order within bounds that permit one, near the wanted ones."""
    found = np.maximum.accumulate(wanted)
    found += np.minimum.accumulate(wanted[::-1])[::-1]
    found *= 0.5
    low, high = np.maximum.accumulate(lowest), np.minimum.accumulate(highest[::-1])[::-1]
    return np.clip(found, low, np.maximum(low, high, out=high), out=found)
