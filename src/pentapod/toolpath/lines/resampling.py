"""Adaptive resampling of passes: as few waypoints as the tolerances allow, evenly spread.

First the density: between waypoints at most `spacing`, at most `axis_step` of turning, and √(8 · chordal · R) where the
surface curves with radius R; waypoints are spread evenly over the integral of that density. Then the check: wherever a
corner of the line on the mesh is further than `chordal` from its chord, the worst such corner becomes a waypoint, until
there is none. So the tolerance is kept on coarse meshes too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.directions import angle_between
from pentapod.geometry.runs import run_starts
from pentapod.mesh.passes import Passes


@dataclass(frozen=True)
class ResamplingOptions:
    """rounds: largest number of rounds in which corners are added. same_point: nearer points are one, metres."""

    rounds: int = 64
    same_point: float = 1e-9


def resample(
    passes: Passes,
    *,
    chordal: float,
    spacing: float,
    axis_step: float,
    closest: float,
    options: ResamplingOptions = ResamplingOptions(),
) -> Passes:
    """Return the passes with new points on the same lines; first and last points stay.

    chordal, spacing, closest: metres; axis_step: radians. No two points are closer than `closest`; corners of the line
    closer to a waypoint than that may leave its chord by as much. Passes shorter than twice that are left out.
    """
    passes = without_duplicates(passes.where(passes.lengths >= 2.0 * closest), options.same_point)
    if not len(passes):
        return passes
    place = np.concatenate([[0.0], np.cumsum(np.where(passes.within, passes.steps, 1.0))])
    samples = _evenly(passes, place, chordal, spacing, axis_step, closest)
    fixed = np.zeros(len(samples), dtype=np.bool_)
    fixed[np.searchsorted(samples, place[passes.starts[:-1]])] = True
    fixed[np.searchsorted(samples, place[passes.starts[1:] - 1])] = True
    for _ in range(options.rounds):
        worst = place[_worst_corners(passes, place, samples, samples[fixed], chordal, closest)]
        worst = worst[np.diff(worst, prepend=-np.inf) >= closest]
        if not len(worst):
            break
        # Corners become waypoints and replace evenly spread ones nearby.
        free = ~fixed & (_gap(worst, samples) >= closest)
        samples = np.concatenate([samples[fixed], worst, samples[free]])
        fixed = np.concatenate([np.ones(len(samples) - int(free.sum()), np.bool_), np.zeros(int(free.sum()), np.bool_)])
        order = np.argsort(samples, kind="stable")
        samples, fixed = samples[order], fixed[order]
    return _at(passes, place, samples)


def without_duplicates(passes: Passes, closest: float) -> Passes:
    """Return the passes without points closer than `closest` to the previous one; ends stay, unless they meet."""
    while len(passes):
        passes = passes.where(passes.lengths >= 2.0 * closest)
        short = np.concatenate([[False], passes.within & (passes.steps < closest)])
        if not short.any():
            break
        # In a run of short steps every second point is removed, so that the others move apart.
        index = np.arange(len(short))
        run = index - np.maximum.accumulate(np.where(short, -1, index))
        drop = short & (run % 2 == 1)
        last = passes.starts[1:] - 1
        ends = last[drop[last]]
        drop[ends] = False
        drop[ends - 1] |= ~np.isin(ends - 1, passes.starts[:-1])
        if not drop.any():
            break
        counts = np.bincount(passes.pass_of_point[~drop], minlength=len(passes))
        starts = run_starts(counts)
        passes = Passes(passes.points[~drop], passes.normals[~drop], starts, passes.levels)
    return passes


def _evenly(passes: Passes, place: Floats, chordal: float, spacing: float, axis_step: float, closest: float) -> Floats:
    """Return the places of waypoints spread evenly over the density that the tolerances ask for.

    Between opposite normals, as on both sides of a channel, the bound on the turning is as good as endless.
    """
    turn = np.where(passes.within, angle_between(passes.normals[1:], passes.normals[:-1]), 0.0)
    needed = np.maximum(
        np.maximum(passes.steps / spacing, _turning(passes) / axis_step), np.sqrt(passes.steps * turn / (8.0 * chordal))
    )
    needed = np.minimum(needed, 0.5 * passes.steps / closest)  # rounded up, that is at most twice as many
    quantity = np.concatenate([[0.0], np.cumsum(np.where(passes.within, needed, 1.0))])
    first, last = passes.starts[:-1], passes.starts[1:] - 1
    total = quantity[last] - quantity[first]
    # Rounding must not cost an additional waypoint.
    intervals = np.maximum(np.ceil(total * (1.0 - 1e-9)), 1.0).astype(np.intp)
    owner = np.repeat(np.arange(len(passes)), intervals + 1)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(intervals + 1) - (intervals + 1), intervals + 1)
    wanted = quantity[first][owner] + total[owner] * number / intervals[owner]
    samples = np.interp(wanted, quantity, place)
    samples = np.where(number == 0, place[first][owner], samples)
    return np.where(number == intervals[owner], place[last][owner], samples)


def _turning(passes: Passes) -> Floats:
    """Return an upper bound (N − 1,) on how fast the axis turns within each step, radians per step.

    Between normals that are interpolated linearly the axis turns fastest where they are shortest.
    """
    start, step = passes.normals[:-1], np.diff(passes.normals, axis=0)
    square = np.maximum((step * step).sum(axis=1), 1e-300)
    t = np.clip(-(start * step).sum(axis=1) / square, 0.0, 1.0)[:, None]
    shortest = np.linalg.norm(start + t * step, axis=1)
    return np.where(passes.within, np.sqrt(square) / np.maximum(shortest, 1e-3), 0.0)


def _worst_corners(
    passes: Passes, place: Floats, samples: Floats, fixed: Floats, chordal: float, closest: float
) -> Ints:
    """Return for each chord the point of the pass that is furthest from it, if that is more than `chordal`."""
    ends = _interpolated(passes.points, place, samples)
    chord = np.clip(np.searchsorted(samples, place, side="right") - 1, 0, len(samples) - 2)
    start, along = ends[chord], ends[chord + 1] - ends[chord]
    offset = passes.points - start
    square = np.maximum((along * along).sum(axis=1), 1e-300)
    t = np.clip((offset * along).sum(axis=1) / square, 0.0, 1.0)
    distance = np.linalg.norm(offset - t[:, None] * along, axis=1)
    beyond = np.flatnonzero((distance > chordal) & (_gap(fixed, place) >= closest))
    order = beyond[np.lexsort((-distance[beyond], chord[beyond]))]
    return order[np.flatnonzero(np.diff(chord[order], prepend=-1))]


def _gap(among: Floats, places: Floats) -> Floats:
    """Return the distance (N,) of places from the nearest of the ascending numbers `among`, not empty."""
    after = np.clip(np.searchsorted(among, places), 1, max(len(among) - 1, 1))
    return np.minimum(np.abs(places - among[after - 1]), np.abs(places - among[np.minimum(after, len(among) - 1)]))


def _at(passes: Passes, place: Floats, samples: Floats) -> Passes:
    first = place[passes.starts[:-1]]
    starts = np.concatenate([np.searchsorted(samples, first), [len(samples)]]).astype(np.intp)
    points = _interpolated(passes.points, place, samples)
    return Passes(points, _interpolated(passes.normals, place, samples), starts, passes.levels)


def _interpolated(values: Floats, place: Floats, samples: Floats) -> Floats:
    return np.stack([np.interp(samples, place, values[:, k]) for k in range(3)], axis=1)
