"""Lower bound on the clearance between bodies at all times: branch and bound over stretches of rows.

In the middle of each stretch the gaps are computed. From there no body moves farther than the faster end of the
platform's line does, whose speed is proven; where that could use up a gap, no farther than the legs of the stretch let
the platform (`Robot.enclose`; lemmas 9 and 13 of docs/proofs.md). A stretch that may hold a gap smaller than the
smallest one found is cut into four.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.numerics.blocks import blocks
from pentapod.verify.replay.replay import Replay

ROUND_UP = 1.0 + 1e-9
"""Factor that exceeds the rounding of sums of positive terms."""


@dataclass(frozen=True)
class ClearanceOptions:
    """Options of the search. They change how tight the bound is and what it costs, never whether it holds.

    coarsest: rows of the first stretches; cuts: into how many pieces one is cut. longest: rows up to which a stretch is
    decided though its bound is below a gap that was found, by near_m, in metres, or near_share of that gap. at_once:
    stretches whose gaps are computed together; enclosed_at_once: stretches whose displacement is.
    """

    coarsest: int = 1024
    longest: int = 64
    cuts: int = 4
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


Gaps = Callable[[Ints, float], Floats]
"""Gaps (n, C) in metres at samples (n,) of the replay; larger ones than the second argument may be less, but not than
that."""

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
    size, starts = options.coarsest, np.arange(0, count, options.coarsest)
    met, decided = np.inf, list[ClearanceBound]()
    while True:
        samples = starts + np.minimum(starts + size, count)
        decrease = approaches(travels(replay, starts, size, offsets))
        values, most = np.empty_like(decrease), decrease.max(axis=1)
        order = np.argsort(most, kind="stable")
        for part in (order[part] for part in blocks(len(order), options.at_once)):
            # A gap that is larger than this cannot be used up.
            values[part] = gaps(samples[part], max(met, 0.0) + ROUND_UP * float(most[part[-1]]))
            met = min(met, float(values[part].min()))
        worst = np.unravel_index(int(values.argmin()), values.shape)
        if values[worst] <= bound:
            return ClearanceBound(float(values[worst]), int(worst[1]), int(samples[worst[0]]), True)
        lower, target = values - decrease, met
        if size <= options.longest:
            target = met - max(options.near_m, options.near_share * (met - bound)) if size > 1 else -np.inf

            def enclosed(rows: Ints, size: int = size, starts: Ints = starts) -> Floats:
                return approaches(displacements(replay, starts[rows], size, offsets, options))

            _tighten(lower, values, enclosed, target, met, options.enclosed_at_once)
        again = lower.min(axis=1) < target
        kept = np.where(again[:, None], np.inf, lower)
        row, column = np.unravel_index(int(kept.argmin()), kept.shape)
        gap = float(kept[row, column])
        decided.append(ClearanceBound(gap, int(column), int(samples[row]), bool(np.isfinite(gap))))
        if not again.any():
            return min(decided, key=lambda found: found.gap)
        size //= options.cuts
        starts = (starts[again, None] + size * np.arange(options.cuts)).ravel()
        starts = starts[starts < count]


def _tighten(
    lower: Floats, values: Floats, enclosed: Callable[[Ints], Floats], target: float, met: float, at_once: int
) -> None:
    """Raise lower bounds (n, C) of gaps to what the legs allow, `values` less `enclosed`, where that can matter.

    That is where they are below the target, and where they are the least of the others.
    """
    least = lower.min(axis=1)
    order, kept = np.argsort(least, kind="stable"), met
    for part in blocks(len(order), at_once):
        rows = order[part]
        if least[rows[0]] >= max(target, kept):
            return
        lower[rows] = np.maximum(lower[rows], values[rows] - enclosed(rows))
        own = lower[rows].min(axis=1)
        kept = min(kept, float(own[own >= target].min(initial=np.inf)))


def travels(replay: Replay, starts: Ints, size: int, offsets: Floats) -> Displacement:
    """Return displacements within `size` intervals from each start, from the middle of each, by the speeds of chords.

    Infinite where a chord is not proven. The speeds are of the tip and of the line's faster end; a point in between is
    displaced as its share of both, one beyond the ends as a lever.
    """
    machine, count = replay.machine, len(replay.program.legs) - 1
    chords = 0.5 * replay.program.period * replay.interval_bounds.speeds[:, [0, 2]]
    ends = np.minimum(starts + size, count)
    edges = np.stack([2 * starts, starts + ends, 2 * ends], axis=1).ravel()
    halves = np.add.reduceat(np.append(chords, np.zeros((1, 2)), axis=0), edges, axis=0).reshape(-1, 3, 2)[:, :2]
    of_tip, of_ends = ROUND_UP * halves.max(axis=1).T
    low, tip, high = min(machine.bars.offsets), machine.tool_length, max(*machine.bars.offsets, machine.tool_length)
    share = np.clip((tip - offsets) / (tip - low), 0.0, 1.0)
    share = np.where(offsets > tip, 1.0, share)
    beyond = np.maximum(np.maximum(low - offsets, offsets - high), 0.0) / (high - low)
    with np.errstate(invalid="ignore"):  # zero times infinity
        points = of_tip[:, None] * (1.0 - share) + of_ends[:, None] * (share + 2.0 * beyond)
    points = np.where(np.isfinite(of_tip + of_ends)[:, None], points, np.inf)
    joints = np.repeat(of_ends[:, None], machine.robot.n_legs, axis=1) if machine.robot.arms.any() else None
    return Displacement(points, (of_tip + of_ends) / (tip - low), joints)


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
