"""How near bodies come to each other at any time: proven from some moments, and how far bodies stray from there.

Time is cut into stretches of rows. In the middle of each the gaps are computed; from there on no body moves further
than `enclose` proves of the platform (lemmas 9 and 13 of docs/proofs.md). Stretches that may hold a gap smaller than
what is known are cut into eight.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.blocks import blocks
from pentapod.verify.replay.replay import Replay

_LONGEST, _CUT = 64, 8
_AT_ONCE, _CHUNK = 4096, 512  # stretches: the bodies of all of a long program would fill the memory
_NEAR_M, _NEAR = 2e-5, 0.3
"""A proven gap is not improved on where it is this much, or this share, below one that is met."""


@dataclass(frozen=True, eq=False)
class Stray:
    """How far, at most, things move from where they are in the middle of n stretches.

    line (n, K): points of the platform line at the offsets asked for, metres. turn (n,): the line's direction.
    """

    line: Floats
    turn: Floats


Gaps = Callable[[Ints], Floats]
"""Gaps (n, C) in metres at samples (n,) of the replay."""

Moves = Callable[[Stray], Floats]
"""By how much (n, C) each of those gaps can shrink at most."""


@dataclass(frozen=True)
class Approach:
    """The smallest gap, metres: none is smaller at any time. column: of which gap; sample: where. proven: or not."""

    least: float
    column: int
    sample: int
    proven: bool


def approach(replay: Replay, gaps: Gaps, moves: Moves, offsets: Floats, *, bound: float = 0.0) -> Approach:
    """Return the smallest gap over all times. Ends early where a gap at a sample is not above `bound`.

    offsets (K,): along the platform line, metres, of the points whose way `moves` goes by.
    """
    count = len(replay.program.legs) - 1
    size, starts = _LONGEST, np.arange(0, count, _LONGEST)
    met, found = np.inf, list[Approach]()
    while True:
        ends = np.minimum(starts + size, count)
        samples = starts + ends
        values = np.concatenate([gaps(samples[part]) for part in blocks(len(samples), _AT_ONCE)])
        worst = np.unravel_index(int(values.argmin()), values.shape)
        if values[worst] < met:
            met = float(values[worst])
            if met <= bound:
                return Approach(met, int(worst[1]), int(samples[worst[0]]), True)
        if size == _LONGEST:
            lower = values - moves(_first_stray(replay, starts, offsets))
        else:
            strays = (moves(stray_of(replay, starts[part], size, offsets)) for part in blocks(len(starts), _AT_ONCE))
            lower = values - np.concatenate(list(strays))
        target = met - max(_NEAR_M, _NEAR * (met - bound))
        again = (lower.min(axis=1) < target) if size > 1 else np.zeros(len(starts), dtype=np.bool_)
        kept = np.where(again[:, None], np.inf, lower)
        row, column = np.unravel_index(int(kept.argmin()), kept.shape)
        least = float(kept[row, column])
        found.append(Approach(least, int(column), int(samples[row]), bool(np.isfinite(least))))
        if not again.any():
            return min(found, key=lambda approach: approach.least)
        size //= _CUT
        starts = (starts[again, None] + size * np.arange(_CUT)).ravel()
        starts = starts[starts < count]


def _first_stray(replay: Replay, starts: Ints, offsets: Floats) -> Stray:
    """Return how far the platform strays within the longest stretches: claims that ask the same share the answer."""
    key = ("stray", offsets.tobytes())
    if key not in replay.shared:
        replay.shared[key] = stray_of(replay, starts, _LONGEST, offsets)
    return cast("Stray", replay.shared[key])


def stray_of(replay: Replay, starts: Ints, size: int, offsets: Floats) -> Stray:
    """Return how far the platform strays within `size` intervals from each start, seen from their middle."""
    (position, direction), last = replay.pose, len(replay.program.legs) - 2
    line, turn = np.empty((len(starts), len(offsets))), np.empty(len(starts))
    for first in range(0, len(starts), _CHUNK):
        rows = slice(first, first + _CHUNK)
        intervals = np.minimum(starts[rows, None] + np.arange(size), last)
        lengths = leg_control_points(replay, intervals)
        middle = starts[rows] + np.minimum(starts[rows] + size, last + 1)
        ends = position[middle], direction[middle]
        line[rows], turn[rows] = replay.machine.robot.enclose(ends, lengths, offsets)
    return Stray(line, turn)


def leg_control_points(replay: Replay, intervals: Ints) -> Floats:
    """Return leg lengths (n, M, n_legs) whose hull holds the legs on intervals (n, m): the Bernstein coefficients."""
    legs, slopes = replay.program.legs, replay.slopes
    if slopes is None:
        return np.concatenate([legs[intervals], legs[intervals[:, -1:] + 1]], axis=1)
    third = slopes / 3.0
    start, end = legs[intervals], legs[intervals + 1]
    return np.concatenate([start, start + third[intervals], end - third[intervals + 1], end[:, -1:]], axis=1)
