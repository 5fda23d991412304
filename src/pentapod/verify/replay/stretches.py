"""Stretches of a replay that count as straight: some chords between samples, and how far the motion is off them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.geometry.directions import angle_between, arc_weights
from pentapod.geometry.runs import marked_runs
from pentapod.numerics.blocks import blocks
from pentapod.verify.replay.replay import Replay

LONGEST, CUT = 64, 8
"""Chords of the longest stretch, and into how many pieces one is cut that is not good enough."""
_WIDEST = 1.0
"""Radians: arcs that turn farther are not taken for one stretch."""
_BLOCK = 1 << 10  # stretches


@dataclass(frozen=True, eq=False)
class Stretches:
    """From sample starts (n,) to ends (n,)."""

    starts: Ints
    ends: Ints

    @classmethod
    def along(cls, chords: Bools) -> Stretches:
        """Return the runs of marked chords (M − 1,)."""
        return cls(*marked_runs(chords).T)

    def where(self, keep: Bools | slice | Ints) -> Stretches:
        """Return some of the stretches."""
        return Stretches(self.starts[keep], self.ends[keep])

    def cut(self, size: int) -> Stretches:
        """Return the stretches of at most `size` chords that make these up."""
        parts = -(-(self.ends - self.starts) // size)
        number = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
        starts = np.repeat(self.starts, parts) + size * number
        return Stretches(starts, np.minimum(starts + size, np.repeat(self.ends, parts)))


def strays(replay: Replay, stretches: Stretches, lever: float) -> Floats:
    """Return by how much (n,) points of the tool are at most off the straight stretch, at any time, metres.

    Infinite where the tool turns too far for that to be said. lever: how far they are from the tilt centre at most.

    A moment is compared with the place of the stretch that is nearest to it. Between two samples that place goes
    evenly, and unit vectors on an arc θ are off the line through two of them by no more than θ²/8.
    """
    found = np.empty(len(stretches.starts))
    for part in blocks(len(found), _BLOCK):
        found[part] = _stray(replay, stretches.where(part), lever)
    return found


def _stray(replay: Replay, of: Stretches, lever: float) -> Floats:
    # Samples and the chords that they begin; the last sample of a stretch is where it ends.
    counts = of.ends - of.starts
    begins = np.cumsum(counts) - counts
    sample = np.repeat(of.starts - begins, counts) + np.arange(counts.sum())
    start, end = replay.tilt_centres[of.starts], replay.tilt_centres[of.ends]
    first, last = replay.axes[of.starts], replay.axes[of.ends]
    way, turn = end - start, last - first
    square = np.einsum("ij,ij->i", way, way) + lever**2 * np.einsum("ij,ij->i", turn, turn)
    owner = np.repeat(np.arange(len(counts)), counts)
    off, turned = replay.tilt_centres[sample] - start[owner], replay.axes[sample] - first[owner]
    along = np.einsum("ij,ij->i", off, way[owner]) + lever**2 * np.einsum("ij,ij->i", turned, turn[owner])
    share = np.divide(along, square[owner], out=np.zeros_like(along), where=square[owner] > 0.0)
    share = np.clip(share, 0.0, 1.0)[:, None]
    aside = np.maximum.reduceat(np.linalg.norm(off - share * way[owner], axis=1), begins)
    away = np.maximum.reduceat(replay.interval_bounds.away[sample], begins)
    if lever == 0.0:
        return aside + away
    angle = angle_between(first, last)
    a, b = arc_weights(angle[owner, None], share)
    swung = replay.axes[sample] - (a * first[owner] + b * last[owner])
    apart = np.maximum.reduceat(np.linalg.norm(swung, axis=1), begins) + 0.125 * angle**2
    tilt = np.arcsin(np.minimum(apart, 1.0)) + np.maximum.reduceat(replay.interval_bounds.turned[sample], begins)
    # An axis as far as a radius from the arc may point anywhere.
    return np.where((angle < _WIDEST) & (apart < 1.0), aside + away + lever * tilt, np.inf)
