"""Claim on the clearance between the legs and the shaft of the machine itself."""

from __future__ import annotations

from functools import partial

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.machine.clearance.leg_clearance import clearances, pair_names
from pentapod.machine.machine import Machine
from pentapod.numerics.blocks import blocks, in_blocks
from pentapod.verify.replay.claim import MM, Claim, Finding
from pentapod.verify.replay.replay import Replay

STRETCH = 32
"""Samples of the stretches of which only the middle is evaluated first."""


def clearance(replay: Replay) -> Finding:
    """Judge that legs and shaft do not touch each other, at any time.

    Every point of a leg or of the shaft moves by no more than the faster of the platform line's two ends, or a platform
    joint beside the line, whose speeds are proven; so the distance between two bodies changes by no more than twice the
    travel of that end. Stretches of samples whose middle is farther apart than this bound can use up are skipped.
    """
    machine, (position, direction) = replay.machine, replay.pose
    chords = 0.5 * replay.program.period * replay.interval_bounds.speeds[:, 2]
    travelled = np.zeros(len(chords) + 1)
    np.cumsum(chords, out=travelled[1:])

    starts = np.arange(0, len(travelled), STRETCH)
    ends = np.append(starts[1:], len(chords))
    middles = (starts + ends) // 2
    at_middle = in_blocks(partial(_least_clearance, machine), position[middles], direction[middles])
    travel = np.maximum(travelled[middles] - travelled[starts], travelled[ends] - travelled[middles])
    close = np.flatnonzero(at_middle - 2.0 * travel <= at_middle.min())
    samples = (starts[close, None] + np.arange(STRETCH)).ravel()
    samples = samples[samples <= len(chords)]

    def nearest(own: Ints) -> tuple[float, int, int]:
        """Return the smallest lower bound of the distances around samples `own`, its sample and its pair."""
        # The longer of the chords that meet at a sample: half a chord to either side is as far as any moment is from
        # its nearest sample, and twice that is a chord.
        around = np.maximum(chords[np.maximum(own - 1, 0)], chords[np.minimum(own, len(chords) - 1)])
        found = clearances(machine, position[own], direction[own]) - around[:, None]
        row, column = np.unravel_index(int(np.argmin(found)), found.shape)
        return float(found[row, column]), int(own[row]), int(column)

    least, at, pair = min(nearest(samples[part]) for part in blocks(len(samples), 1 << 13))
    method = (
        f"{pair_names(machine)[pair]} come closest; proven lower bound for all times, surface to surface: distance at "
        "the rows and halfway between, less the largest possible approach until the next sample"
    )
    return Finding(least > 0.0, MM * least, 0.0, "mm", replay.place(at), method, at_least=True)


def _least_clearance(machine: Machine, position: Floats, direction: Floats) -> Floats:
    return clearances(machine, position, direction).min(axis=1)


CLAIMS = (Claim("clearance between legs and shaft", clearance, needs_proof=True),)
