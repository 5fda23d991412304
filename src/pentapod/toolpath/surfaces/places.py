"""Places of a cutter that rolls over a part: put exactly on a surface, with chords and links that are proven clear.

Which places are clear, and how a place is moved onto the surface, depends on the cutter (`BallCentres`, `TipPlaces`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.base.values import Value
from pentapod.mesh.passes import Passes


@dataclass(frozen=True)
class PlaceOptions(Value):
    """How places are moved onto a surface, and links judged on it. Shares are of the cutter's radius.

    on_level: how near to the surface a point is put; reach, aside: how far a place of the tip is moved onto its surface
    from near it, and sideways on a link. rounds: of moving, and of halving chords. longest: of a link on the surface,
    as a multiple of the straight way; uneven: of its longest step. window: length over which normals are averaged along
    a line: at creases they jump. side: how far beside a line both sides of a corner are looked for; corner: angle
    between them, radians, from which they are two.
    """

    on_level: float = 1e-7
    reach: float = 0.25
    aside: float = 0.5
    rounds: int = 30
    longest: float = 2.5
    uneven: float = 3.0
    window: float = 1.0
    side: float = 0.02
    corner: float = float(np.radians(5.0))


class Places(ABC):
    """Where a cutter may be over a part. options: of moving and halving; radius: of the cutter, metres."""

    options: PlaceOptions
    radius: float

    @abstractmethod
    def settled(self, points: Floats, towards: Floats) -> tuple[Floats, Bools]:
        """Return points (N, 3) moved onto the surface, and which of them are on it then.

        towards (N, 3): normals of the surface near the points, of any length.
        """

    @abstractmethod
    def on_level(self, points: Floats) -> Floats:
        """Return points (N, 3) moved onto the surface, as far as that is possible."""

    @abstractmethod
    def raised(self, points: Floats) -> Floats:
        """Return points (N, 3), those that are not clear moved onto the surface."""

    @abstractmethod
    def clear(self, starts: Floats, ends: Floats, chordal: float) -> Bools:
        """Return on which chords (M,) the cutter is proven to cut into the part by no more than `chordal` metres."""

    @abstractmethod
    def near(self, points: Floats, towards: Floats, chordal: float) -> Bools:
        """Return which points (N, 3) are at most `chordal` metres off the surface, outwards. towards: see `settled`."""

    @abstractmethod
    def normals(self, points: Floats) -> Floats:
        """Return unit normals (N, 3) for contacts of the cutter at places on the surface."""

    def exact(self, passes: Passes, chordal: float, closest: float) -> Passes:
        """Return passes with their points on the surface, and with more where a chord leaves it by more than `chordal`.

        No chord cuts into the part by more: that is proven. How far it is from the surface outwards is measured in its
        middle. Where no place is found between two points, a pass ends and another begins. closest: metres; shorter
        chords are not halved: they are clear for their length.
        """
        shortest = min(closest, 2.0 * chordal)
        points, held = self.settled(passes.points, passes.normals)
        points, owner, towards = points[held], passes.pass_of_point[held], passes.normals[held]
        torn = owner[1:] != owner[:-1]
        live = ~torn
        for _ in range(self.options.rounds):
            rows = np.flatnonzero(live)
            rows = rows[np.linalg.norm(points[rows + 1] - points[rows], axis=1) > shortest]
            live[:] = False
            if not len(rows):
                break
            middles, between = (0.5 * (values[rows] + values[rows + 1]) for values in (points, towards))
            cut = ~self.clear(points[rows], points[rows + 1], chordal)
            bad = cut | ~self.near(middles, between, chordal)
            rows, cut, between = rows[bad], cut[bad], between[bad]
            middles, held = self.settled(middles[bad], between)
            torn[rows[cut & ~held]] = True
            rows = rows[held]
            live[rows] = True
            points, towards = (
                np.insert(values, rows + 1, new[held], axis=0)
                for values, new in ((points, middles), (towards, between))
            )
            owner, torn = (np.insert(array, rows + 1, array[rows]) for array in (owner, torn))
            live = np.insert(live, rows + 1, True)
        torn |= live
        begins, ends = np.flatnonzero(np.append(True, torn)), np.flatnonzero(np.append(torn, True))
        whole = Passes(points, self.normals(points), np.append(begins, len(points)), passes.levels[owner[begins]])
        return whole.where(ends > begins)

    def ways(self, starts: Floats, ends: Floats, spacing: float, chordal: float, closest: float) -> list[Floats | None]:
        """Return for each pair of places (L, 3) the points (n, 3) of a way on or above the surface, ends included.

        It is the straight way, moved onto the surface where that is in the part, its chords proven as those of `exact`.
        None where it would be long, or jump.
        """
        length = np.linalg.norm(ends - starts, axis=1)
        count = np.maximum(np.ceil(length / spacing), 2.0).astype(np.intp) + 1
        owner = np.repeat(np.arange(len(count)), count)
        share = (np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)) / (count - 1)[owner]
        points = starts[owner] + share[:, None] * (ends - starts)[owner]
        points[share == 1.0] = ends
        inner = (share > 0.0) & (share < 1.0)
        points[inner] = self.raised(points[inner])
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        found: list[Floats | None] = []
        for k, first in enumerate(np.cumsum(count) - count):
            own = steps[first : first + count[k] - 1]
            even = (
                own.max() <= self.options.uneven * spacing and own.sum() <= self.options.longest * length[k] + spacing
            )
            found.append(self._cleared(points[first : first + count[k]], chordal, closest) if even else None)
        return found

    def _cleared(self, points: Floats, chordal: float, closest: float) -> Floats | None:
        """Return a line with its chords halved until all are clear; None where it jumps."""
        for _ in range(self.options.rounds):
            bad = np.flatnonzero(~self.clear(points[:-1], points[1:], chordal))
            if not len(bad):
                return points
            middles = 0.5 * (points[bad] + points[bad + 1])
            if np.linalg.norm(points[bad + 1] - points[bad], axis=1).min() < closest:
                return None
            points = np.insert(points, bad + 1, self.raised(middles), axis=0)
        return None
