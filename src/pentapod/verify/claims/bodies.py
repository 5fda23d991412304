"""Claim that the bodies of the machine do not touch each other."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.machine.clearance.leg_clearance import clearances, pair_names
from pentapod.numerics.blocks import blocks
from pentapod.verify.replay.claim import MM, Claim, Finding
from pentapod.verify.replay.replay import Replay

_BLOCK = 32  # samples
_AT_ONCE = 1 << 13  # samples whose bodies are placed together


def clearance(replay: Replay) -> Finding:
    """Judge that legs and shaft keep apart, at all times.

    Every point of a leg or of the shaft moves by no more than the faster of the platform line's two ends, whose speeds
    are proven; so the distance between two bodies changes by no more than twice the way of that end. Blocks of
    samples whose middle is farther apart than this bound can use up are never looked into.
    """
    machine, (position, direction) = replay.machine, replay.pose
    chords = 0.5 * replay.program.period * replay.interval_bounds.speeds[:, 2]
    way = np.concatenate([[0.0], np.cumsum(chords)])

    starts = np.arange(0, len(way), _BLOCK)
    ends = np.append(starts[1:], len(chords))
    middles = (starts + ends) // 2
    at_middle = clearances(machine, position[middles], direction[middles]).min(axis=1)
    travel = np.maximum(way[middles] - way[starts], way[ends] - way[middles])
    close = np.flatnonzero(at_middle - 2.0 * travel <= at_middle.min())
    samples = np.unique((starts[close, None] + np.arange(_BLOCK)).clip(max=len(chords)))
    around = _around(chords)

    def nearest(own: Ints) -> tuple[float, int, int]:
        """Return the least distance less what may be lost around samples `own`, its sample and its pair."""
        # Half a chord to either side is as far as any moment is from its nearest sample; twice that is a chord.
        found = clearances(machine, position[own], direction[own]) - around[own, None]
        row, column = np.unravel_index(int(np.argmin(found)), found.shape)
        return float(found[row, column]), int(own[row]), int(column)

    least, at, pair = min(nearest(samples[part]) for part in blocks(len(samples), _AT_ONCE))
    method = (
        f"{pair_names(machine)[pair]} come closest; proven bound for all times, surface to surface: at the rows and "
        "halfway between, less the largest approach possible on the way to the next sample"
    )
    return Finding(least > 0.0, MM * least, 0.0, "mm", replay.place(at), method)


def _around(chords: Floats) -> Floats:
    """Return the longer (M,) of the chords (M − 1,) that meet at each sample."""
    return np.concatenate([chords[:1], np.maximum(chords[1:], chords[:-1]), chords[-1:]])


CLAIMS = (Claim("clearance between legs and shaft", clearance, needs_proof=True),)
