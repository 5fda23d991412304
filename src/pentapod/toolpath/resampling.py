"""Resampling: waypoints along passes, as few as the tolerances allow, evenly spread.

Density first: between waypoints at most `spacing`, at most `axis_step` of turning, and √(8 · chordal · R)
where the surface curves with radius R; waypoints are spread evenly over the integral of that density. Then
proof: wherever a corner of the mesh's own slice is further than `chordal` from the chord that passes it,
the worst such corner becomes a waypoint, until there is none. So the result holds the tolerance on coarse
meshes too.
"""

from __future__ import annotations

import numpy as np

from pentapod.arrays import Floats, Ints
from pentapod.geometry.directions import angle_between
from pentapod.toolpath.passes import Passes

_MAX_ROUNDS = 64


def resample(passes: Passes, *, chordal: float, spacing: float, axis_step: float, closest: float) -> Passes:
    """Return the passes with their points chosen anew on the same lines; first and last points stay.

    chordal, spacing, closest: metres; axis_step: radians. Points closer than `closest` are not kept apart.
    """
    passes = without_duplicates(passes, closest)
    if not len(passes):
        return passes
    place = np.concatenate([[0.0], np.cumsum(np.where(passes.within, passes.steps, 1.0))])
    samples = _evenly(passes, place, chordal, spacing, axis_step)
    fixed = np.isin(samples, place)
    for _ in range(_MAX_ROUNDS):
        worst = _worst_corners(passes, place, samples, chordal)
        if not len(worst):
            break
        samples, index = np.unique(np.concatenate([samples, place[worst]]), return_index=True)
        fixed = np.concatenate([fixed, np.ones(len(worst), dtype=np.bool_)])[index]
        near = np.diff(samples) < closest
        crowded = np.concatenate([near, [False]]) | np.concatenate([[False], near])
        samples, fixed = samples[fixed | ~crowded], fixed[fixed | ~crowded]
    return _at(passes, place, samples)


def without_duplicates(passes: Passes, closest: float) -> Passes:
    """Return the passes without points closer than `closest` to the one before; shorter passes vanish."""
    passes = passes.where(passes.lengths >= 2.0 * closest)
    while len(passes):
        short = np.concatenate([[False], passes.within & (passes.steps < closest)])
        if not short.any():
            break
        # In a run of short steps every second point goes, so that what is left moves apart.
        index = np.arange(len(short))
        run = index - np.maximum.accumulate(np.where(short, -1, index))
        drop = short & (run % 2 == 1)
        last = passes.starts[1:] - 1
        ends = last[drop[last]]
        drop[ends] = False
        drop[ends - 1] |= ~np.isin(ends - 1, passes.starts[:-1])
        counts = np.bincount(passes.pass_of_point[~drop], minlength=len(passes))
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.intp)
        passes = Passes(passes.points[~drop], passes.normals[~drop], starts, passes.planes)
    return passes


def _evenly(passes: Passes, place: Floats, chordal: float, spacing: float, axis_step: float) -> Floats:
    """Return places of waypoints spread evenly over the density that the tolerances ask for."""
    turn = np.where(passes.within, angle_between(passes.normals[1:], passes.normals[:-1]), 0.0)
    needed = np.maximum(
        np.maximum(passes.steps / spacing, turn / axis_step), np.sqrt(passes.steps * turn / (8.0 * chordal))
    )
    quantity = np.concatenate([[0.0], np.cumsum(np.where(passes.within, needed, 1.0))])
    first, last = passes.starts[:-1], passes.starts[1:] - 1
    total = quantity[last] - quantity[first]
    # A hair's breadth of rounding must not cost a waypoint more.
    intervals = np.maximum(np.ceil(total * (1.0 - 1e-9)), 1.0).astype(np.intp)
    owner = np.repeat(np.arange(len(passes)), intervals + 1)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(intervals + 1) - (intervals + 1), intervals + 1)
    wanted = quantity[first][owner] + total[owner] * number / intervals[owner]
    samples = np.interp(wanted, quantity, place)
    samples = np.where(number == 0, place[first][owner], samples)
    return np.where(number == intervals[owner], place[last][owner], samples)


def _worst_corners(passes: Passes, place: Floats, samples: Floats, chordal: float) -> Ints:
    """Return the points of the passes that are worst within their chord, where beyond `chordal`."""
    ends = _interpolated(passes.points, place, samples)
    chord = np.clip(np.searchsorted(samples, place, side="right") - 1, 0, len(samples) - 2)
    start, along = ends[chord], ends[chord + 1] - ends[chord]
    offset = passes.points - start
    square = np.maximum((along * along).sum(axis=1), 1e-300)
    t = np.clip((offset * along).sum(axis=1) / square, 0.0, 1.0)
    distance = np.linalg.norm(offset - t[:, None] * along, axis=1)
    distance[np.isin(place, samples)] = 0.0
    beyond = np.flatnonzero(distance > chordal)
    order = beyond[np.lexsort((-distance[beyond], chord[beyond]))]
    return order[np.flatnonzero(np.diff(chord[order], prepend=-1))]


def _at(passes: Passes, place: Floats, samples: Floats) -> Passes:
    first = place[passes.starts[:-1]]
    starts = np.concatenate([np.searchsorted(samples, first), [len(samples)]]).astype(np.intp)
    points = _interpolated(passes.points, place, samples)
    return Passes(points, _interpolated(passes.normals, place, samples), starts, passes.planes)


def _interpolated(values: Floats, place: Floats, samples: Floats) -> Floats:
    return np.stack([np.interp(samples, place, values[:, k]) for k in range(3)], axis=1)
