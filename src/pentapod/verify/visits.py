"""When a sampled motion passes each waypoint of a polyline, in order.

Soundness does not rest on this search: it only proposes times. `pentapod.verify.matching` measures what the
proposal is worth, and any monotone matching bounds the deviation from above.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from pentapod.arrays import Bools, Floats, Ints
from pentapod.geometry.runs import marked_runs

_MAX_PAIRS = 6_000_000  # chord–waypoint pairs that one search may hold in memory


@dataclass(frozen=True, eq=False)
class Visits:
    """times (n,): non-decreasing, in samples (2.25 is a quarter of the way from sample 2 to 3).

    missed (n,): the waypoints that the motion does not pass within the search radius in this order; their
    times are interpolated.
    """

    times: Floats
    missed: Bools


@dataclass(frozen=True, eq=False)
class Course:
    """A polyline in space and direction: points (n, 3) metres, axes (n, 3) unit."""

    points: Floats
    axes: Floats


def find_visits(motion: Course, path: Course, arc: Floats, radius: float, axis_weight: Floats) -> Visits | None:
    """Return when the motion passes each waypoint of the path within `radius` metres, as early as possible.

    arc (n,): arc length of the path at the waypoints, metres. axis_weight (n,) in m²/rad²: what the angle of
    the axis counts beside the distance where the closest moment is sought; positive where the path turns on
    the spot. None where the search would need too much memory.
    """
    pairs = _pairs(motion.points, path.points, radius)
    if pairs is None:
        return None
    n, last = len(path.points), len(motion.points) - 1
    passes = _passes(motion, path, axis_weight, radius, pairs)
    chosen = _in_order(passes, n)
    missed = chosen < 0
    seen = ~missed
    low, high, best = np.zeros(n), np.full(n, float(last)), np.zeros(n)
    for times, of in ((low, passes.enter), (high, passes.leave), (best, passes.best)):
        times[seen] = of[chosen[seen]]
        # Whatever else is seen, both begin together and end together.
        times[[0, -1]] = 0.0, last
    seen[[0, -1]] = True
    # The earliest and the latest times that keep the order, and the closest moments squeezed between them.
    best = _settled(motion, path, axis_weight, chosen, passes, best)
    low, best = np.maximum.accumulate(low), np.maximum.accumulate(best)
    high = np.minimum.accumulate(high[::-1])[::-1]
    times = np.minimum(np.maximum(best, low), high)
    return Visits(np.maximum.accumulate(np.where(seen, times, np.interp(arc, arc[seen], times[seen]))), missed)


@dataclass(frozen=True, eq=False)
class _Passes:
    """Each stay of the motion within the radius of a waypoint, sorted by waypoint and time (in samples)."""

    waypoint: Ints
    enter: Floats
    leave: Floats
    best: Floats


def _pairs(samples: Floats, waypoints: Floats, radius: float) -> tuple[Ints, Ints] | None:
    """Return waypoints and chords (P,) that may come within the radius, sorted by waypoint, then chord."""
    middles, lengths = 0.5 * (samples[:-1] + samples[1:]), np.linalg.norm(np.diff(samples, axis=0), axis=1)
    # Long chords would widen the search for all: each class has a tree of its own, and is twice as long as the last.
    classes = np.ceil(np.log2(np.maximum(lengths / radius, 1.0)))
    searches: list[tuple[Ints, KDTree, float]] = []
    for k in np.unique(classes):
        members = np.flatnonzero(classes == k)
        searches.append((members, _tree(middles[members]), radius + 0.5 * float(lengths[members].max())))
    tree, found = _tree(waypoints), list[tuple[Ints, Ints]]()
    if sum(int(tree.count_neighbors(other, reach)) for _, other, reach in searches) > _MAX_PAIRS:
        return None
    for members, other, reach in searches:
        close = tree.sparse_distance_matrix(other, reach, output_type="ndarray")
        found.append((close["i"].astype(np.intp), members[close["j"].astype(np.intp)]))
    waypoint = np.concatenate([w for w, _ in found])
    chord = np.concatenate([c for _, c in found])
    order = np.lexsort((chord, waypoint))
    return waypoint[order], chord[order]


def _tree(points: Floats) -> KDTree:
    # A dwell is thousands of equal points, which a balanced tree takes badly.
    return KDTree(points, balanced_tree=False, compact_nodes=False)


def _passes(motion: Course, path: Course, axis_weight: Floats, radius: float, pairs: tuple[Ints, Ints]) -> _Passes:
    """Return the stays within the radius, from pairs that are sorted by waypoint and chord."""
    waypoint, chord = pairs
    step, away = _differences(motion.points, path.points, chord, waypoint)
    # |away − t step|² ≤ radius²: one stretch of each chord, by a quadratic in t.
    a, b, c = _dot(step, step), _dot(step, away), _dot(away, away) - radius * radius
    moving, discriminant = a > 0.0, b * b - a * c
    root = np.sqrt(np.maximum(discriminant, 0.0))
    enter = np.maximum(np.divide(b - root, a, out=np.zeros_like(a), where=moving), 0.0)
    leave = np.minimum(np.divide(b + root, a, out=np.ones_like(a), where=moving), 1.0)
    # Where the motion stands a and b are 0, and so is the discriminant.
    inside = (discriminant >= 0.0) & (b - root <= a) & (b + root >= 0.0) & (moving | (c <= 0.0))
    waypoint, chord, enter, leave = waypoint[inside], chord[inside], enter[inside], leave[inside]
    if not len(waypoint):
        return _Passes(waypoint, *np.zeros((3, len(waypoint))))
    closest, cost = _closest(motion, path, axis_weight, waypoint, chord)
    # A stay goes on over consecutive chords as long as the sample between them is inside.
    new = np.ones(len(waypoint), dtype=np.bool_)
    new[1:] = (np.diff(waypoint * len(motion.points) + chord) != 1) | (leave[:-1] < 1.0)
    first = np.flatnonzero(new)
    last = np.append(first[1:], len(new)) - 1
    order = np.lexsort((cost, np.cumsum(new)))
    times: list[Floats] = [np.add(chord, at, dtype=np.float64) for at in (enter, leave, closest)]
    return _Passes(waypoint[first], times[0][first], times[1][last], times[2][order[first]])


def _closest(motion: Course, path: Course, axis_weight: Floats, waypoint: Ints, chord: Ints) -> tuple[Floats, Floats]:
    """Return the place (P,) in [0, 1] on each chord nearest its waypoint, and the squared distance there."""
    step, away = _differences(motion.points, path.points, chord, waypoint)
    turn, apart = _differences(motion.axes, path.axes, chord, waypoint)
    weight = axis_weight[waypoint]
    square = _dot(step, step) + weight * _dot(turn, turn)
    along = _dot(step, away) + weight * _dot(turn, apart)
    t = np.clip(np.divide(along, square, out=np.zeros_like(square), where=square > 0.0), 0.0, 1.0)
    off, turned = away - t[:, None] * step, apart - t[:, None] * turn
    return t, _dot(off, off) + weight * _dot(turned, turned)


def _in_order(passes: _Passes, n: int) -> Ints:
    """Return for each of n waypoints the earliest pass that keeps the order, −1 where there is none.

    Taking the earliest is optimal: any other choice leaves the later waypoints less time. The choice for a
    waypoint depends on the one before, so this is a loop, over plain numbers: 0.3 µs a waypoint.
    """
    first, behind = (np.searchsorted(passes.waypoint, np.arange(n), side).tolist() for side in ("left", "right"))
    enter, leave = passes.enter.tolist(), passes.leave.tolist()
    chosen, now = [-1] * n, -np.inf
    for k in range(n):
        c, end = first[k], behind[k]
        while c < end and leave[c] < now:
            c += 1
        if c < end:
            chosen[k] = c
            now = max(now, enter[c])
    return np.array(chosen, dtype=np.intp)


def _settled(motion: Course, path: Course, axis_weight: Floats, chosen: Ints, passes: _Passes, best: Floats) -> Floats:
    """Return the closest moments (n,) where those of neighbouring waypoints contradict or may be mistaken.

    Out of order are they where waypoints lie closer together than the motion is exact; mistaken where the
    axis turns there and back on the spot. Such runs of waypoints are assigned together, in order, at the least
    sum of squared distances, each within its own stay: a shortest path through the chords of the stays.
    """
    late = np.maximum.accumulate(best) > best
    early = np.minimum.accumulate(best[::-1])[::-1] < best
    doubtful = (chosen >= 0) & (late | early | axis_weight.astype(np.bool_))
    doubtful[[0, -1]] = False
    settled = best.copy()
    for start, stop in marked_runs(doubtful).tolist():
        stays: list[tuple[int, Floats, Floats]] = []
        for k in range(start, stop):
            first, last = (min(int(x[chosen[k]]), len(motion.points) - 2) for x in (passes.enter, passes.leave))
            chords = np.arange(first, last + 1)
            place, cost = _closest(motion, path, axis_weight, np.full(len(chords), k), chords)
            if stays:
                before, _, sums = stays[-1]
                reached = np.minimum.accumulate(sums).take(chords - before, mode="clip")
                cost = cost + np.where(chords >= before, reached, np.inf)
            stays.append((first, place, cost))
        limit = len(motion.points)
        for k in range(stop - 1, start - 1, -1):
            first, place, cost = stays[k - start]
            at = int(np.argmin(cost[: limit - first + 1]))
            limit, settled[k] = first + at, first + at + place[at]
    return settled


def _differences(samples: Floats, targets: Floats, chord: Ints, waypoint: Ints) -> tuple[Floats, Floats]:
    """Return the chords (P, 3) and the vectors (P, 3) from their first ends to their waypoints."""
    return samples[chord + 1] - samples[chord], targets[waypoint] - samples[chord]


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("ij,ij->i", a, b)
