"""Lower bound on the clearance between bodies at all times: branch and bound over stretches of rows.

In the middle of each stretch the gaps are computed. From there no body moves farther than the proven displacement of
the platform allows (`Robot.enclose`; lemmas 9 and 13 of docs/proofs.md). A stretch that may hold a gap smaller than the
smallest one found is cut into eight.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.blocks import blocks
from pentapod.verify.replay.replay import Replay


@dataclass(frozen=True)
class ClearanceOptions:
    """Options of the search. They change how tight the bound is and what it costs, never whether it holds.

    longest: rows of the first stretches; cuts: into how many pieces one is cut. near_m, near_share: a bound is not
    tightened where it is this much, in metres or as a share, below a gap that was found. at_once: stretches whose gaps
    are computed together; enclosed_at_once: stretches whose displacement is.
    """

    longest: int = 64
    cuts: int = 8
    near_m: float = 2e-5
    near_share: float = 0.3
    at_once: int = 4096
    enclosed_at_once: int = 512


@dataclass(frozen=True, eq=False)
class Displacement:
    """Bounds on the displacement of the platform within n stretches, from where it is in the middle of each.

    points (n, K): of points on the platform line, metres. turn (n,): of unit vectors along the line. joints (n,
    n_legs): of the platform joints, where some are beside the line; else None, and points of the line tell.
    """

    points: Floats
    turn: Floats
    joints: Floats | None = None


Gaps = Callable[[Ints], Floats]
"""Gaps (n, C) in metres at samples (n,) of the replay."""

Approaches = Callable[[Displacement], Floats]
"""Upper bounds (n, C), metres, on the decrease of those gaps for a displacement of the platform."""


@dataclass(frozen=True)
class ClearanceBound:
    """gap: metres; none is smaller at any time. column: of which gap; sample: where. proven: whether it is finite."""

    gap: float
    column: int
    sample: int
    proven: bool


def clearance_bound(
    replay: Replay,
    gaps: Gaps,
    approaches: Approaches,
    offsets: Floats,
    *,
    bound: float = 0.0,
    options: ClearanceOptions = ClearanceOptions(),
) -> ClearanceBound:
    """Return the lower bound of all gaps over all times. Ends early where a gap at a sample is not above `bound`.

    offsets (K,): metres along the platform line, of the points whose displacement `approaches` is given.
    """
    count = len(replay.program.legs) - 1
    size, starts = options.longest, np.arange(0, count, options.longest)
    met, decided = np.inf, list[ClearanceBound]()
    while True:
        samples = starts + np.minimum(starts + size, count)
        values = np.concatenate([gaps(samples[part]) for part in blocks(len(samples), options.at_once)])
        worst = np.unravel_index(int(values.argmin()), values.shape)
        if values[worst] < met:
            met = float(values[worst])
            if met <= bound:
                return ClearanceBound(met, int(worst[1]), int(samples[worst[0]]), True)
        if size == options.longest:
            lower = values - approaches(_first_displacements(replay, starts, offsets, options))
        else:
            parts = (starts[part] for part in blocks(len(starts), options.at_once))
            decreases = [approaches(displacements(replay, part, size, offsets, options)) for part in parts]
            lower = values - np.concatenate(decreases)
        target = met - max(options.near_m, options.near_share * (met - bound))
        again = (lower.min(axis=1) < target) if size > 1 else np.zeros(len(starts), dtype=np.bool_)
        kept = np.where(again[:, None], np.inf, lower)
        row, column = np.unravel_index(int(kept.argmin()), kept.shape)
        gap = float(kept[row, column])
        decided.append(ClearanceBound(gap, int(column), int(samples[row]), bool(np.isfinite(gap))))
        if not again.any():
            return min(decided, key=lambda found: found.gap)
        size //= options.cuts
        starts = (starts[again, None] + size * np.arange(options.cuts)).ravel()
        starts = starts[starts < count]


def _first_displacements(replay: Replay, starts: Ints, offsets: Floats, options: ClearanceOptions) -> Displacement:
    """Return the displacements within the longest stretches; claims about the same points share them."""
    key = ("displacements", options.longest, offsets.tobytes())
    if key not in replay.shared:
        replay.shared[key] = displacements(replay, starts, options.longest, offsets, options)
    return cast("Displacement", replay.shared[key])


def displacements(
    replay: Replay, starts: Ints, size: int, offsets: Floats, options: ClearanceOptions = ClearanceOptions()
) -> Displacement:
    """Return the displacements within `size` intervals from each start, from the middle of each stretch."""
    (position, direction), last = replay.pose, len(replay.program.legs) - 2
    robot = replay.machine.robot
    points, turn = np.empty((len(starts), len(offsets))), np.empty(len(starts))
    joints = np.empty((len(starts), robot.n_legs)) if robot.arms.any() else None
    for rows in blocks(len(starts), options.enclosed_at_once):
        intervals = np.minimum(starts[rows, None] + np.arange(size), last)
        middle = starts[rows] + np.minimum(starts[rows] + size, last + 1)
        pose, lengths = (position[middle], direction[middle]), leg_control_points(replay, intervals)
        points[rows], turn[rows] = robot.enclose(pose, lengths, offsets)
        if joints is not None:
            joints[rows] = robot.enclose_joints(pose, lengths)
    return Displacement(points, turn, joints)


def leg_control_points(replay: Replay, intervals: Ints) -> Floats:
    """Return Bernstein coefficients (n, M, n_legs) of the leg lengths on intervals (n, m); their hull holds them."""
    legs, slopes = replay.program.legs, replay.slopes
    if slopes is None:
        return np.concatenate([legs[intervals], legs[intervals[:, -1:] + 1]], axis=1)
    third = slopes / 3.0
    start, end = legs[intervals], legs[intervals + 1]
    return np.concatenate([start, start + third[intervals], end - third[intervals + 1], end[:, -1:]], axis=1)
