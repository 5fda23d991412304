"""The sweep without compiled kernels: the same branch and bound as `sweep_kernels`, on arrays of pieces at once.

All motions are looked at together, breadth first: in each round every piece (a box or part of a facet, for a stretch of
time) gets its bound, what cannot hold a deeper point is dropped, and the rest is halved in space or in time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pentapod.arrays import Bools, Floats, Ints

_SHARE = 1e-2
_MOST_ROUNDS = 400


@dataclass(frozen=True, eq=False)
class _Pieces:
    """K pieces: the motion (K,) each belongs to, the middle and half length of its stretch of time (K,).

    shapes (K, ...): what else each is: the number of a box, or the corners (K, 3, 3) of part of a facet.
    """

    motion: Ints
    middle: Floats
    half: Floats
    shapes: NDArray[Any]
    facet: Ints

    def where(self, keep: Bools | Ints) -> _Pieces:
        return _Pieces(*(getattr(self, name)[keep] for name in self.__dataclass_fields__))

    def halved_in_time(self) -> list[_Pieces]:
        """Return the pieces for the first and the second half of their time."""
        return [
            _Pieces(self.motion, self.middle + sign * 0.5 * self.half, 0.5 * self.half, self.shapes, self.facet)
            for sign in (-1.0, 1.0)
        ]


def _joined(parts: list[_Pieces]) -> _Pieces:
    names = _Pieces.__dataclass_fields__
    return _Pieces(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def sweep_all(
    solid: Floats,
    motions: Floats,
    corners: Floats,
    boxes: Floats,
    starts: Ints,
    threshold: float,
    eps: float,
    depths: Floats,
    where: Floats,
    facets: Ints,
) -> None:
    """Fill depths (M,), where (M, 4): time and point, and facets (M,), −1 where none is beyond the threshold.

    Arguments as those of the kernel of this name.
    """
    count = len(motions)
    best, facets[:] = np.full(count, -threshold), -1
    moving = (motions[:, 15] > 0.0) | (motions[:, 16] > 0.0)
    whole = _Pieces(
        np.arange(count), np.full(count, 0.5), np.where(moving, 0.5, 0.0), np.zeros(count, np.intp), np.arange(count)
    )
    pieces = _facets_near(solid, motions, corners, boxes, starts, best, eps, whole)
    for _ in range(_MOST_ROUNDS):
        if not len(pieces.motion):
            break
        pieces = _halved(solid, motions, pieces, best, eps, (where, facets))
    found = facets >= 0
    depths[found] = -best[found]


def _worth(bound: Floats, best: Floats, eps: float) -> Bools:
    """Return whether a piece whose points are no deeper than a bound may hold one that is deeper than the best."""
    return bound < best - eps + _SHARE * np.minimum(best, 0.0)


def _facets_near(
    solid: Floats,
    motions: Floats,
    corners: Floats,
    boxes: Floats,
    starts: Ints,
    best: Floats,
    eps: float,
    pieces: _Pieces,
) -> _Pieces:
    """Return the facets that may hold a point beyond the threshold, each for a stretch of time."""
    first_leaf = len(starts) - 2
    near: list[_Pieces] = []
    while len(pieces.motion):
        box = boxes[pieces.shapes]
        f, slope, rate, reach = _slope(solid, motions[pieces.motion], pieces.middle, box[:, :3])
        axes = box[:, 6:].reshape(-1, 3, 3)
        fall = (box[:, 3:6] * np.abs((axes * slope[:, None]).sum(axis=2))).sum(axis=1)
        loss = _loss(motions[pieces.motion], rate, reach, pieces.half, np.linalg.norm(box[:, 3:6], axis=1))
        keep = _worth(f - fall - loss, best[pieces.motion], eps)
        pieces, by_time = pieces.where(keep), (loss > fall)[keep]
        leaf = pieces.shapes - first_leaf
        leaves = pieces.where(leaf >= 0)
        if len(leaves.motion):
            begin, end = starts[leaf[leaf >= 0]], starts[leaf[leaf >= 0] + 1]
            row = np.repeat(np.arange(len(begin)), end - begin)
            number = np.arange(len(row)) - np.repeat(np.cumsum(end - begin) - (end - begin), end - begin) + begin[row]
            some = leaves.where(row)  # a row for each facet of the leaf
            near.append(_Pieces(some.motion, some.middle, some.half, corners[number], number))
        late, inner = pieces.where((leaf < 0) & by_time), pieces.where((leaf < 0) & ~by_time)
        children = [
            _Pieces(inner.motion, inner.middle, inner.half, 2 * inner.shapes + side, inner.facet) for side in (1, 2)
        ]
        pieces = _joined([*late.halved_in_time(), *children])
    if near:
        return _joined(near)
    none = np.zeros(0, dtype=np.intp)
    return _Pieces(none, np.zeros(0), np.zeros(0), np.zeros((0, 3, 3)), none)


def _halved(
    solid: Floats, motions: Floats, pieces: _Pieces, best: Floats, eps: float, found: tuple[Floats, Ints]
) -> _Pieces:
    """Lower `best` by the middles of pieces of facets, and return what may be deeper still, halved."""
    where, facets = found
    own, shape = motions[pieces.motion], pieces.shapes
    centre = shape.mean(axis=1)
    f, slope, rate, reach = _slope(solid, own, pieces.middle, centre)
    before = best.copy()
    np.minimum.at(best, pieces.motion, f)
    better = np.flatnonzero((f == best[pieces.motion]) & (f < before[pieces.motion]))
    rows = pieces.motion[better]
    facets[rows] = pieces.facet[better]
    where[rows, 0], where[rows, 1:] = pieces.middle[better], centre[better]
    offsets = shape - centre[:, None]
    lowest = np.minimum((offsets * slope[:, None]).sum(axis=2).min(axis=1), 0.0)
    size = np.linalg.norm(offsets, axis=2).max(axis=1)
    loss = _loss(own, rate, reach, pieces.half, size)
    keep = _worth(f + lowest - loss, best[pieces.motion], eps)
    by_time = loss > -lowest
    late, wide = pieces.where(keep & by_time), pieces.where(keep & ~by_time)
    # The longest side is halved.
    shape = wide.shapes
    rows = np.arange(len(shape))
    longest = np.linalg.norm(np.roll(shape, -1, axis=1) - shape, axis=2).argmax(axis=1)
    after, far = (longest + 1) % 3, (longest + 2) % 3
    a, b, c = shape[rows, longest], shape[rows, after], shape[rows, far]
    middle = 0.5 * (a + b)
    parts = [np.stack(corners, axis=1) for corners in ((a, middle, c), (middle, b, c))]
    split = [_Pieces(wide.motion, wide.middle, wide.half, part, wide.facet) for part in parts]
    return _joined([*late.halved_in_time(), *split])


def _slope(solid: Floats, motions: Floats, times: Floats, points: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return f (K,), its gradient (K, 3) in the mesh's frame, ∂f/∂t, and the distance from the pivot, at points."""
    pivots = motions[:, 0:3] + times[:, None] * motions[:, 6:9]
    turned = (times * motions[:, 16])[:, None]
    axes = np.cos(turned) * motions[:, 3:6] + np.sin(turned) * motions[:, 9:12]
    away = points - pivots
    height = (away * axes).sum(axis=1)
    aside = away - height[:, None] * axes
    radius = np.linalg.norm(aside, axis=1)
    f, by_radius, by_height = meridian_distances(solid, radius, height + motions[:, 17])
    scale = np.where(radius > 1e-15, by_radius / np.where(radius > 1e-15, radius, 1.0), 0.0)
    slope = scale[:, None] * aside + by_height[:, None] * axes
    # The body moves with velocity V + ω × w at the point; seen from it the point moves the other way.
    velocity = motions[:, 6:9] + np.cross(motions[:, 12:15], away)
    return f, slope, -(slope * velocity).sum(axis=1), np.linalg.norm(away, axis=1)


def _loss(motions: Floats, rate: Floats, reach: Floats, half: Floats, size: Floats) -> Floats:
    """Return how far f may fall (K,) below its tangent plane within ± half of the time, for offsets up to `size`."""
    angle, way = motions[:, 16], motions[:, 15]
    bend = angle * angle * (reach + way * half + size) + 2.0 * angle * way
    return np.abs(rate) * half + 0.5 * half * half * bend + angle * half * size


def meridian_distances(solid: Floats, r: Floats, z: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the signed distance (K,) of radii and heights to a solid (5,), and its derivatives by both."""
    low, high, low_radius, high_radius, rounding = (float(number) for number in solid)
    side_r, side_z = high_radius - low_radius, high - low
    length = float(np.hypot(side_r, side_z))
    normal_r, normal_z = (side_z / length, -side_r / length) if length > 0.0 else (1.0, 0.0)
    beyond = (r - low_radius) * normal_r + (z - low) * normal_z
    below, above = low - z, z - high
    inside = (below <= 0.0) & (above <= 0.0) & (beyond <= 0.0)
    deepest = np.maximum(np.maximum(beyond, below), above)
    on_side, on_low = beyond == deepest, below == deepest
    in_r = np.where(on_side, normal_r, 0.0)
    in_z = np.where(on_side, normal_z, np.where(on_low, -1.0, 1.0))
    # Outside: the nearest point of the outline, which is the lower disc, the slanted side and the upper disc.
    along = np.zeros_like(r)
    if length > 0.0:
        along = np.clip(((r - low_radius) * side_r + (z - low) * side_z) / (length * length), 0.0, 1.0)
    candidates = np.stack([
        np.stack([np.minimum(r, low_radius), np.full_like(r, low)]),
        np.stack([np.minimum(r, high_radius), np.full_like(r, high)]),
        np.stack([low_radius + along * side_r, low + along * side_z]),
    ])  # fmt: skip
    gaps = np.stack([r, z]) - candidates
    nearest = np.linalg.norm(gaps, axis=1).argmin(axis=0)
    gap = gaps[nearest, :, np.arange(len(r))]
    distance = np.linalg.norm(gap, axis=1)
    known = distance > 1e-15
    out = gap / np.where(known, distance, 1.0)[:, None]
    out_r, out_z = np.where(known, out[:, 0], normal_r), np.where(known, out[:, 1], normal_z)
    return (
        np.where(inside, deepest, distance) - rounding,
        np.where(inside, in_r, out_r),
        np.where(inside, in_z, out_z),
    )
