"""Passes: many polylines on a surface, in flat arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints, set_frozen
from pentapod.geometry.runs import run_starts

SAME_NORMAL = 1e-6
"""Difference of two normals up to which they are the same."""


@dataclass(frozen=True, eq=False)
class Passes:
    """P polylines: pass k holds the points starts[k] to starts[k + 1] − 1, at least two.

    points (N, 3): metres, on the surface. normals (N, 3): of the surface, not of unit length; between two points the
    direction is that of the linear interpolation. starts (P + 1,). levels (P,): the line of the strategy, such as the
    slicing plane, that each pass belongs to.
    """

    points: Floats
    normals: Floats
    starts: Ints
    levels: Ints

    def __post_init__(self) -> None:
        for name in ("points", "normals", "starts", "levels"):
            array = np.asarray(getattr(self, name)).copy()
            array.flags.writeable = False
            set_frozen(self, **{name: array})

    def __len__(self) -> int:
        return len(self.levels)

    @cached_property
    def pass_of_point(self) -> Ints:
        """The pass (N,) of each point."""
        return np.repeat(np.arange(len(self)), np.diff(self.starts))

    @cached_property
    def within(self) -> Bools:
        """Whether (N − 1,) the step from point j to j + 1 stays in one pass."""
        return self.pass_of_point[1:] == self.pass_of_point[:-1]

    @cached_property
    def steps(self) -> Floats:
        """Distance (N − 1,) in metres from point j to j + 1, zero between passes."""
        return np.where(self.within, np.linalg.norm(np.diff(self.points, axis=0), axis=1), 0.0)

    @cached_property
    def lengths(self) -> Floats:
        """Length (P,) of each pass, metres."""
        sums = np.concatenate([[0.0], np.cumsum(self.steps)])
        return sums[self.starts[1:] - 1] - sums[self.starts[:-1]] if len(self) else np.zeros(0)

    @cached_property
    def closed(self) -> Bools:
        """Whether (P,) each pass ends where it begins, with the same normal: balls turn about corners."""
        first, last = self.starts[:-1], self.starts[1:] - 1
        same = (self.points[first] == self.points[last]).all(axis=1)
        turned = np.abs(self.normals[first] - self.normals[last]).max(axis=1, initial=0.0)
        return same & (turned < SAME_NORMAL) & (np.diff(self.starts) > 3)

    def where(self, keep: Bools) -> Passes:
        """Return the passes (P,) marked in `keep`."""
        return self.slices(self.starts[:-1][keep], self.starts[1:][keep] - 1)

    def by_level(self) -> Passes:
        """Return the passes ordered by level; those of one level keep their order."""
        order = np.argsort(self.levels, kind="stable")
        return self.slices(self.starts[order], self.starts[order + 1] - 1)

    def split(self, keep: Bools) -> Passes:
        """Return the runs of two or more consecutive points (N,) marked in `keep`, as passes of their own."""
        joined = keep[1:] & keep[:-1] & self.within
        begins = np.flatnonzero(keep & ~np.append(False, joined))
        ends = np.flatnonzero(keep & ~np.append(joined, False))
        long = ends > begins
        return self.slices(begins[long], ends[long])

    def slices(self, begins: Ints, ends: Ints) -> Passes:
        """Return the runs of points begins[k] to ends[k], both included, as passes; runs may share their ends."""
        counts = ends - begins + 1
        starts = run_starts(counts)
        index = np.repeat(begins - starts[:-1], counts) + np.arange(int(counts.sum()))
        levels = self.levels[self.pass_of_point[begins]]
        return Passes(self.points[index], self.normals[index], starts, levels)

    def without_spikes(self, near: float) -> Passes:
        """Return the passes without what leads to a point and straight back: where that is all, none is left.

        near: metres up to which two points are the same; of equal neighbours one is kept.
        """
        rows, owner = np.arange(len(self.points)), self.pass_of_point
        for apart in (1, 2):  # equal neighbours; then points that come back to the one before the last
            while len(rows) > apart:
                place, line = self.points[rows], owner[rows]
                same = (line[apart:] == line[:-apart]) & (
                    np.linalg.norm(place[apart:] - place[:-apart], axis=1) <= near
                )
                same[1:] &= ~same[:-1]
                if not same.any():
                    break
                # The first and the last point of a pass stay.
                before = np.flatnonzero(same)
                after = before + apart
                ends = np.append(line[1:] != line[:-1], True)
                keep = np.ones(len(rows), dtype=np.bool_)
                keep[np.where(ends[after], before, after)] = False
                if apart > 1:
                    keep[before + 1] = False
                rows = rows[keep]
        counts = np.bincount(owner[rows], minlength=len(self))
        kept = counts > 1
        rows = rows[kept[owner[rows]]]
        return Passes(self.points[rows], self.normals[rows], run_starts(counts[kept]), self.levels[kept])

    def rows(self, k: int) -> slice:
        """Return where the points of pass k are."""
        return slice(int(self.starts[k]), int(self.starts[k + 1]))

    @classmethod
    def of(cls, lines: list[tuple[Floats, Floats]], levels: Ints | None = None) -> Passes:
        """Return the passes of lines, each points and normals (n, 3), n ≥ 2; by default each its own level."""
        starts = run_starts([len(points) for points, _ in lines])
        points, normals = (np.concatenate([line[k] for line in lines] or [np.zeros((0, 3))]) for k in range(2))
        return cls(points, normals, starts, np.arange(len(lines)) if levels is None else levels)

    @classmethod
    def joined(cls, parts: list[Passes]) -> Passes:
        """Return the passes of all parts, the levels of each numbered after those before."""
        if not parts:
            return cls.of([])
        points, normals = (np.concatenate([getattr(p, name) for p in parts]) for name in ("points", "normals"))
        counts = np.concatenate([np.diff(p.starts) for p in parts])
        first, levels = 0, []
        for part in parts:
            levels.append(part.levels + first)
            first += int(part.levels.max(initial=-1)) + 1
        starts = run_starts(counts)
        return cls(points, normals, starts, np.concatenate(levels))
