"""Centres of a ball that rolls over a part: put exactly on its offset, with chords and links that are proven clear.

A ball is clear at a centre whatever its axis. Chords are proven by their exact distance from the part.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.base.values import Value
from pentapod.geometry.directions import normalised
from pentapod.geometry.runs import marked_runs
from pentapod.mesh.normals import unit_or_zero
from pentapod.mesh.offset.offset_surface import onto_level
from pentapod.mesh.passes import Passes
from pentapod.mesh.query.tree import FacetTree


@dataclass(frozen=True)
class DriveOptions(Value):
    """How a drive surface is made and used.

    step: of the grid, as a share of the ball's radius. parts: how many times finer it is in channels between its
    nodes; narrower ones may be closed. on_level: as a share of the radius, how near to the offset a point is put.
    rounds: of moving it there, and of halving chords. window: length over which normals are averaged along a line,
    as a share of the radius: at creases they jump. side: how far beside a line both sides of a corner are looked
    for, as a share of the radius; corner: angle between them, radians, from which they are two. border: how exactly
    an open border is known, as a share of the radius; enters: how far beyond it the ball gets where it is no hole.
    longest: of a link on the surface, as a multiple of the straight way; uneven: of its longest step. around:
    longest link around what is in the way, as a multiple of the straight way and twice the clearance. beside,
    sideways: distances around a point at both of which the surface above must hide it, above: by which height, all
    as shares of the radius: walls, and valleys between steep flanks, do not hide themselves, nor do walls that lean
    under by less. under: the same as `sideways` for links, which may lead a little farther; upright: and for those
    between ends over which nothing leans. evened: how often the stepover for a scallop is averaged with that of
    neighbouring facets, whose curvature is noisy. about: how far beyond what the ball touches in a region's box the
    surface is made, as a multiple of the radius: links may lead there.
    """

    step: float = 0.25
    parts: int = 8
    on_level: float = 1e-7
    rounds: int = 30
    window: float = 1.0
    side: float = 0.02
    corner: float = float(np.radians(5.0))
    border: float = 0.02
    enters: float = 0.5
    longest: float = 2.5
    uneven: float = 3.0
    around: float = 3.0
    beside: float = 0.01
    sideways: float = 0.2
    under: float = 0.3
    upright: float = 0.01
    above: float = 0.2
    evened: int = 2
    about: float = 3.0

    def leaning(self, share: float) -> DriveOptions:
        """Return options by which the surface may lean over a point by a share of the radius."""
        sideways = max(share, self.upright)
        return replace(self, sideways=sideways, under=self.under / self.sideways * sideways)


@dataclass(frozen=True, eq=False)
class BallCentres:
    """Where the centre of a ball of `radius` metres may be, over the facets of a tree."""

    tree: FacetTree
    radius: float
    options: DriveOptions

    def on_level(self, points: Floats) -> Floats:
        """Return points (N, 3) moved onto the offset, as far as that is possible: see `onto_level`."""
        return self._settled(points)[0]

    def _settled(self, points: Floats) -> tuple[Floats, Bools]:
        """Return points (N, 3) moved onto the offset, and which of them are on it then."""
        off = self.options.on_level
        points, gaps = onto_level(self.tree, points, self.radius, self.options.rounds, off)
        return points, np.abs(gaps - self.radius) <= off * self.radius

    def exact(self, passes: Passes, chordal: float, closest: float) -> Passes:
        """Return passes with their points on the offset, and with more where a chord leaves it by more than `chordal`.

        No chord comes nearer to the part than radius − chordal: that is proven. How far it is from the offset outwards
        is measured in its middle. Where no centre is found between two points, a pass ends and another begins.
        closest: metres; shorter chords are not halved: they are clear for their length.
        """
        shortest = min(closest, 2.0 * chordal)
        points, held = self._settled(passes.points)
        points, owner = points[held], passes.pass_of_point[held]
        torn = owner[1:] != owner[:-1]
        live = ~torn
        for _ in range(self.options.rounds):
            rows = np.flatnonzero(live)
            rows = rows[np.linalg.norm(points[rows + 1] - points[rows], axis=1) > shortest]
            live[:] = False
            if not len(rows):
                break
            middles = 0.5 * (points[rows] + points[rows + 1])
            cut = ~self.clear(points[rows], points[rows + 1], self.radius - chordal)
            bad = cut | ~self.tree.within(middles, self.radius + chordal)
            rows, cut = rows[bad], cut[bad]
            middles, held = self._settled(middles[bad])
            torn[rows[cut & ~held]] = True
            rows = rows[held]
            live[rows] = True
            points = np.insert(points, rows + 1, middles[held], axis=0)
            owner, torn = (np.insert(array, rows + 1, array[rows]) for array in (owner, torn))
            live = np.insert(live, rows + 1, True)
        torn |= live
        begins, ends = np.flatnonzero(np.append(True, torn)), np.flatnonzero(np.append(torn, True))
        whole = Passes(points, self.normals(points), np.append(begins, len(points)), passes.levels[owner[begins]])
        return whole.where(ends > begins)

    def ways(self, starts: Floats, ends: Floats, spacing: float, chordal: float, closest: float) -> list[Floats | None]:
        """Return for each pair of centres (L, 3) the points (n, 3) of a way on or above the surface, ends included.

        It is the straight way, moved onto the surface where that is nearer to the part than the radius, its chords
        proven as those of `exact`. None where it would be long, or jump.
        """
        length = np.linalg.norm(ends - starts, axis=1)
        count = np.maximum(np.ceil(length / spacing), 2.0).astype(np.intp) + 1
        owner = np.repeat(np.arange(len(count)), count)
        share = (np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)) / (count - 1)[owner]
        points = starts[owner] + share[:, None] * (ends - starts)[owner]
        points[share == 1.0] = ends
        inner = (share > 0.0) & (share < 1.0)
        points[inner] = self._raised(points[inner])
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        found: list[Floats | None] = []
        for k, first in enumerate(np.cumsum(count) - count):
            own = steps[first : first + count[k] - 1]
            even = (
                own.max() <= self.options.uneven * spacing and own.sum() <= self.options.longest * length[k] + spacing
            )
            found.append(self._cleared(points[first : first + count[k]], chordal, closest) if even else None)
        return found

    def _raised(self, points: Floats) -> Floats:
        """Return points (N, 3), those that are too near to the part moved onto the surface."""
        low = self.tree.closest(points, self.radius)[2] >= 0
        points = points.copy()
        points[low] = self.on_level(points[low])
        return points

    def _cleared(self, points: Floats, chordal: float, closest: float) -> Floats | None:
        """Return a line with its chords halved until all are clear by radius − chordal; None where it jumps."""
        for _ in range(self.options.rounds):
            bad = np.flatnonzero(~self.clear(points[:-1], points[1:], self.radius - chordal))
            if not len(bad):
                return points
            middles = 0.5 * (points[bad] + points[bad + 1])
            if np.linalg.norm(points[bad + 1] - points[bad], axis=1).min() < closest:
                return None
            points = np.insert(points, bad + 1, self._raised(middles), axis=0)
        return None

    def normals(self, points: Floats) -> Floats:
        """Return unit normals (N, 3) of the offset at points on it: away from the part's closest points."""
        return normalised(self.tree.closest(points)[1])

    def midway(self, passes: Passes) -> Passes:
        """Return passes with normals midway between the two sides that the ball touches where they lead along a corner.

        One of the two is as near as the other there: which one is found changes from point to point. Where a pass only
        crosses a corner, its normals stay.
        """
        if not len(passes):
            return passes
        side = unit_or_zero(np.cross(self._along(passes), passes.normals)) * self.options.side * self.radius
        left, right = self.normals(passes.points - side), self.normals(passes.points + side)
        cosine = np.einsum("ni,ni->n", left, right)
        corner = (cosine < np.cos(self.options.corner)) & (cosine > -np.cos(self.options.corner))
        place = places(passes)[0]
        for a, b in marked_runs(corner).tolist():
            corner[a:b] = place[b - 1] - place[a] > 0.5 * self.options.window * self.radius
        return replace(passes, normals=np.where(corner[:, None], unit_or_zero(left + right), passes.normals))

    def _along(self, passes: Passes) -> Floats:
        """Return the direction (N, 3) of passes at their points, over half a window."""
        place, first, last = places(passes)
        half = 0.25 * self.options.window * self.radius
        ahead, back = np.minimum(place + half, last), np.maximum(place - half, first)
        return np.stack([np.interp(ahead, place, p) - np.interp(back, place, p) for p in passes.points.T], axis=1)

    def clear(self, starts: Floats, ends: Floats, least: float) -> Bools:
        """Return which chords (M,) are nowhere nearer to the part than `least` metres."""
        return self.tree.clear(starts, ends, least)


def places(passes: Passes) -> tuple[Floats, Floats, Floats]:
    """Return how far along all passes each point is (N,), metres, and where its pass begins and ends."""
    place = np.concatenate([[0.0], np.cumsum(np.where(passes.within, passes.steps, 0.0))])
    owner = passes.pass_of_point
    return place, place[passes.starts[:-1]][owner], place[passes.starts[1:] - 1][owner]


def smoothed(passes: Passes, window: float) -> Floats:
    """Return unit normals (N, 3) of passes, averaged along each over `window` metres, less near its ends."""
    place, first, last = places(passes)
    half = np.minimum(0.5 * window, np.minimum(place - first, last - place))
    middles = 0.5 * (passes.normals[1:] + passes.normals[:-1]) * passes.steps[:, None]
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(middles, axis=0)])
    total = np.stack(
        [np.interp(place + half, place, sums[:, k]) - np.interp(place - half, place, sums[:, k]) for k in range(3)],
        axis=1,
    )
    return normalised(np.where(half[:, None] > 0.0, total, passes.normals))
