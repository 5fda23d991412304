"""Stretches of a motion that are approximated by a straight motion, and the deviation of the motion from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints, row_lengths
from pentapod.geometry.directions import angle_between, arc_weights
from pentapod.geometry.runs import marked_runs
from pentapod.numerics.blocks import blocks
from pentapod.verify.replay.along_toolpath import Motion


@dataclass(frozen=True)
class StretchOptions:
    """How a replay is cut into stretches.

    longest: chords of the longest stretch; cuts: into how many pieces one is cut that is not straight enough.
    largest_turn: radians; no bound is given for a stretch whose axis turns farther. at_once: stretches at a time.
    """

    longest: int = 64
    cuts: int = 8
    largest_turn: float = 1.0
    at_once: int = 1 << 10


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


def deviation_bounds(
    motion: Motion, stretches: Stretches, lever: float, options: StretchOptions = StretchOptions()
) -> Floats:
    """Return upper bounds (n,), metres, on the deviation of points of the tool from the straight stretch, at any time.

    Infinite where the tool turns too far for a bound. lever: largest distance of the points from the tilt centre.

    A moment is compared with the nearest place of the stretch. Between two samples that place moves evenly, and unit
    vectors on an arc θ are off the line through two of them by no more than θ²/8.
    """
    parts = [stretches.where(part) for part in blocks(len(stretches.starts), options.at_once)]
    return np.concatenate([np.empty(0), *(_bounds(motion, part, lever, options.largest_turn) for part in parts)])


def _bounds(motion: Motion, of: Stretches, lever: float, largest_turn: float) -> Floats:
    # Samples and the chords that they begin; the last sample of a stretch is where it ends.
    counts = of.ends - of.starts
    begins = np.cumsum(counts) - counts
    sample = np.repeat(of.starts - begins, counts) + np.arange(counts.sum())
    start, end = motion.tilt_centres[of.starts], motion.tilt_centres[of.ends]
    first, last = motion.axes[of.starts], motion.axes[of.ends]
    chord, turn = end - start, last - first
    square = np.einsum("ij,ij->i", chord, chord) + lever**2 * np.einsum("ij,ij->i", turn, turn)
    owner = np.repeat(np.arange(len(counts)), counts)
    off, turned = motion.tilt_centres[sample] - start[owner], motion.axes[sample] - first[owner]
    along = np.einsum("ij,ij->i", off, chord[owner]) + lever**2 * np.einsum("ij,ij->i", turned, turn[owner])
    share = np.divide(along, square[owner], out=np.zeros_like(along), where=square[owner] > 0.0)
    share = np.clip(share, 0.0, 1.0)[:, None]
    aside = np.maximum.reduceat(row_lengths(off - share * chord[owner]), begins)
    deviation = np.maximum.reduceat(motion.interval_bounds.deviations[sample], begins)
    if lever == 0.0:
        return aside + deviation
    angle = angle_between(first, last)
    a, b = arc_weights(angle[owner, None], share)
    swung = motion.axes[sample] - (a * first[owner] + b * last[owner])
    apart = np.maximum.reduceat(row_lengths(swung), begins) + 0.125 * angle**2
    tilt = np.arcsin(np.minimum(apart, 1.0)) + np.maximum.reduceat(
        motion.interval_bounds.axis_deviations[sample], begins
    )
    # An axis as far as a radius from the arc may point anywhere.
    return np.where((angle < largest_turn) & (apart < 1.0), aside + deviation + lever * tilt, np.inf)
