"""Claim that the bodies of the machine do not touch each other."""

from __future__ import annotations

import numpy as np

from pentapod.arrays import Floats
from pentapod.kinematics.blocks import blocks
from pentapod.machine.clearance import clearances, pair_names
from pentapod.verify.claim import Claim, Finding
from pentapod.verify.replay import Replay

_BLOCK = 32  # samples
_SLACK = 1.05  # a path is longer than the chords through its samples


def clearance(replay: Replay) -> Finding:
    """Judge that legs and shaft keep apart, at all times.

    Every point of a leg or of the shaft moves by no more than the fastest of the platform line's two ends;
    so the distance between two bodies changes by no more than twice the way of that end. Blocks of samples
    whose middle is farther apart than this bound can use up are never looked into.
    """
    machine, (position, direction) = replay.machine, replay.pose
    reach = np.array([machine.pentapod.offsets.min(), max(machine.pentapod.offsets.max(), machine.tool_length)])
    chords = np.empty(len(position) - 1)
    for part in blocks(len(chords)):
        both = slice(part.start, part.stop + 1)
        ends = position[both, None, :] + reach[:, None] * direction[both, None, :]
        chords[part] = _SLACK * np.linalg.norm(np.diff(ends, axis=0), axis=2).max(axis=1)
    way = np.concatenate([[0.0], np.cumsum(chords)])

    middles = np.minimum(np.arange(_BLOCK // 2, len(way) + _BLOCK // 2, _BLOCK), len(way) - 1)
    edges = np.append(np.maximum(middles - _BLOCK // 2, 0), len(way) - 1)
    edges[-2] = min(edges[-2], len(way) - 1)
    at_middle = clearances(machine, position[middles], direction[middles]).min(axis=1)
    travel = np.maximum(way[middles] - way[edges[:-1]], way[edges[1:]] - way[middles])
    close = np.flatnonzero(at_middle - 2.0 * travel <= at_middle.min())
    samples = np.unique((edges[close, None] + np.arange(_BLOCK + 1)).clip(max=len(way) - 1))
    found = clearances(machine, position[samples], direction[samples])
    # Half a chord to either side is as far as any moment is from its nearest sample; twice that is a chord.
    value = found - _around(chords)[samples, None]
    worst, pair = np.unravel_index(int(np.argmin(value)), value.shape)
    least = float(value[worst, pair])
    method = (
        f"{pair_names(machine)[int(pair)]} come closest; surface to surface, at the rows and halfway "
        "between, less the largest approach possible on the way to the next sample"
    )
    return Finding(least > 0.0, 1e3 * least, 0.0, "mm", replay.place(int(samples[worst])), method)


def _around(chords: Floats) -> Floats:
    """Return the longer (M,) of the chords (M − 1,) that meet at each sample."""
    return np.maximum(np.append(chords, 0.0), np.append(0.0, chords))


CLAIMS = (Claim("clearance between legs and shaft", clearance),)
