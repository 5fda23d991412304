"""Passes: many polylines on a surface, in flat arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pentapod.arrays import Bools, Floats, Ints, set_frozen


@dataclass(frozen=True, eq=False)
class Passes:
    """P polylines: pass k holds the points starts[k] to starts[k + 1] − 1, at least two.

    points (N, 3): metres, on the surface. normals (N, 3): such that linear interpolation between points
    gives the surface's normal up to its length (not unit). starts (P + 1,). planes (P,): the slicing plane
    of each.
    """

    points: Floats
    normals: Floats
    starts: Ints
    planes: Ints

    def __post_init__(self) -> None:
        for name in ("points", "normals", "starts", "planes"):
            array = np.asarray(getattr(self, name)).copy()
            array.flags.writeable = False
            set_frozen(self, **{name: array})

    def __len__(self) -> int:
        return len(self.planes)

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

    def where(self, keep: Bools) -> Passes:
        """Return the passes (P,) marked in `keep`."""
        points = keep[self.pass_of_point]
        counts = np.diff(self.starts)[keep]
        starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.intp)
        return Passes(self.points[points], self.normals[points], starts, self.planes[keep])

    def split(self, keep: Bools) -> Passes:
        """Return the runs of two or more consecutive points (N,) marked in `keep`, as passes of their own."""
        begins = keep & ~np.concatenate([[False], keep[:-1] & self.within])
        run = np.cumsum(begins) - 1
        counts = np.bincount(run[keep], minlength=int(begins.sum()))
        long = counts >= 2
        points = keep.copy()
        points[keep] = long[run[keep]]
        starts = np.concatenate([[0], np.cumsum(counts[long])]).astype(np.intp)
        planes = self.planes[self.pass_of_point[begins]][long]
        return Passes(self.points[points], self.normals[points], starts, planes)
