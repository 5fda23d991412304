"""Lower bound on the clearance between bodies at all times: branch and bound over stretches of rows.

In the middle of each stretch the gaps are computed. From there no body moves farther than the faster end of the
platform's line does, whose speed is proven; where that could use up a gap, no farther than the legs of the stretch let
the platform (`Robot.enclose`; lemmas 9 and 13 of docs/proofs.md). A stretch that may hold a gap smaller than the
smallest one found is cut into four. An interval between two rows is cut as well where it may hold a gap below what is
required: in one period at the feed the tool moves by 25 µm, however it moves along an obstacle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints
from pentapod.kinematics.robot import Poses
from pentapod.numerics.bernstein import split
from pentapod.numerics.blocks import blocks
from pentapod.verify.replay.replay import Replay

ROUND_UP = 1.0 + 1e-9
"""Factor that exceeds the rounding of sums of positive terms."""


@dataclass(frozen=True)
class ClearanceOptions:
    """Options of the search. They change how tight the bound is and what it costs, never whether it holds.

    coarsest: rows of the first stretches; cuts: into how many pieces one is cut. longest: rows up to which a stretch is
    decided though its bound is below a gap that was found, by near_m, in metres, or near_share of that gap, if it is
    above what is required. levels: how often an interval between rows is cut; halvings: of each piece of it. at_once:
    stretches whose gaps are computed together; enclosed_at_once: stretches whose displacement is.
    """

    coarsest: int = 1024
    longest: int = 64
    cuts: int = 4
    near_m: float = 2e-5
    near_share: float = 0.3
    levels: int = 3
    halvings: int = 3
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


Gaps = Callable[[Poses, float], Floats]
"""Gaps (n, C) in metres in poses (n, 3); larger ones than the second argument may be less, but not than that."""

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
    """Return the lower bound of all gaps over all times. Ends early where a gap is found that is not above `bound`.

    offsets (K,): metres along the platform line, of the points whose displacement `approaches` is given.
    """
    (position, direction), count = replay.pose, len(replay.program.legs) - 1
    size, starts = options.coarsest, np.arange(0, count, options.coarsest)
    met, decided = np.inf, list[ClearanceBound]()
    while True:
        samples = starts + np.minimum(starts + size, count)
        decrease = approaches(travels(replay, starts, size, offsets))
        values, most = np.empty_like(decrease), decrease.max(axis=1)
        for part in _parts(np.argsort(most, kind="stable"), options.at_once):
            # A gap that is larger than this cannot be used up.
            far = max(met, 0.0) + ROUND_UP * float(most[part[-1]])
            values[part] = gaps((position[samples[part]], direction[samples[part]]), far)
            met = min(met, float(values[part].min()))
        worst = np.unravel_index(int(values.argmin()), values.shape)
        if values[worst] <= bound:
            return ClearanceBound(float(values[worst]), int(worst[1]), int(samples[worst[0]]), True)
        lower, target = values - decrease, met
        if size <= options.longest:
            near = met - max(options.near_m, options.near_share * (met - bound))
            target = max(near, bound) if size > 1 else bound

            def enclosed(rows: Ints, size: int = size, starts: Ints = starts) -> Floats:
                return approaches(displacements(replay, starts[rows], size, offsets, options))

            _tighten(lower, values, enclosed, target, met, options.enclosed_at_once)
        least = lower.min(axis=1)
        again = (least < target) | (least <= bound) if size > 1 else (least <= bound) & np.isfinite(least)
        decided.append(_least(lower, samples, again))
        if size > 1 and again.any():
            size //= options.cuts
            starts = (starts[again, None] + size * np.arange(options.cuts)).ravel()
            starts = starts[starts < count]
            continue
        for rows in _parts(starts[again], options.enclosed_at_once):
            decided.append(_within_rows(replay, rows, gaps, approaches, offsets, bound, options))
            if decided[-1].gap <= bound:
                return decided[-1]
        return min(decided, key=lambda found: found.gap)


def _parts(places: Ints, size: int) -> list[Ints]:
    """Return places (n,) in parts of at most `size`."""
    return [places[part] for part in blocks(len(places), size)]


def _least(lower: Floats, samples: Ints, again: Bools) -> ClearanceBound:
    """Return the least of lower bounds (n, C) around samples (n,), but for those (n,) that are looked at again."""
    kept = np.where(again[:, None], np.inf, lower)
    row, column = np.unravel_index(int(kept.argmin()), kept.shape)
    gap = float(kept[row, column])
    return ClearanceBound(gap, int(column), int(samples[row]), bool(np.isfinite(gap)))


def _within_rows(
    replay: Replay,
    rows: Ints,
    gaps: Gaps,
    approaches: Approaches,
    offsets: Floats,
    bound: float,
    options: ClearanceOptions,
) -> ClearanceBound:
    """Return the lower bound of all gaps between `rows` (n,) and the next ones, cut where it is not above `bound`."""
    curves, samples = np.moveaxis(leg_control_points(replay, rows[:, None]), 1, 2), 2 * rows + 1
    decided = list[ClearanceBound]()
    for level in range(options.levels):
        for _ in range(options.halvings):
            curves, samples = np.concatenate(split(curves)), np.tile(samples, 2)
        poses = replay.machine.robot.pose(split(curves)[0][..., -1], replay.program.component)
        values = gaps(poses, np.inf)
        worst = np.unravel_index(int(values.argmin()), values.shape)
        if values[worst] <= bound:
            return ClearanceBound(float(values[worst]), int(worst[1]), int(samples[worst[0]]), True)
        lower = values - approaches(_displacement(replay, poses, np.moveaxis(curves, 2, 1), offsets))
        again = (lower.min(axis=1) <= bound) & (level + 1 < options.levels)
        decided.append(_least(lower, samples, again))
        if not again.any():
            break
        curves, samples = curves[again], samples[again]
    return min(decided, key=lambda found: found.gap)


def _tighten(
    lower: Floats, values: Floats, enclosed: Callable[[Ints], Floats], target: float, met: float, at_once: int
) -> None:
    """Raise lower bounds (n, C) of gaps to what the legs allow, `values` less `enclosed`, where that can matter.

    That is where they are below the target, and where they are the least of the others.
    """
    least = lower.min(axis=1)
    order, kept = np.argsort(least, kind="stable"), met
    for rows in _parts(order, at_once):
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
    machine, count, longest = replay.machine, len(replay.program.legs) - 1, np.empty((len(starts), 2))
    ends = np.minimum(starts + size, count)
    for part in blocks(len(starts)):
        first, last = 2 * starts[part.start], 2 * ends[part.stop - 1]
        chords = 0.5 * replay.program.period * replay.interval_bounds.speeds[first:last, [0, 2]]
        edges = np.stack([2 * starts, starts + ends, 2 * ends], axis=1)[part].ravel() - first
        sums = np.add.reduceat(np.append(chords, np.zeros((1, 2)), axis=0), edges, axis=0)
        longest[part] = sums.reshape(-1, 3, 2)[:, :2].max(axis=1)
    of_tip, of_ends = ROUND_UP * longest.T
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
    found = list[Displacement]()
    for own in _parts(starts, options.enclosed_at_once):
        intervals = np.minimum(own[:, None] + np.arange(size), last)
        middle = own + np.minimum(own + size, last + 1)
        lengths = leg_control_points(replay, intervals)
        found.append(_displacement(replay, (position[middle], direction[middle]), lengths, offsets))
    joints = [each.joints for each in found if each.joints is not None]
    return Displacement(
        np.concatenate([each.points for each in found]),
        np.concatenate([each.turn for each in found]),
        np.concatenate(joints) if joints else None,
    )


def _displacement(replay: Replay, poses: Poses, lengths: Floats, offsets: Floats) -> Displacement:
    """Return how far the platform can be from n poses while its legs are in the hull of `lengths` (n, M, n_legs)."""
    robot = replay.machine.robot
    joints = robot.enclose_joints(poses, lengths) if robot.arms.any() else None
    return Displacement(*robot.enclose(poses, lengths, offsets), joints)


def leg_control_points(replay: Replay, intervals: Ints) -> Floats:
    """Return Bernstein coefficients (n, M, n_legs) of the leg lengths on intervals (n, m); their hull holds them."""
    legs, slopes = replay.program.legs, replay.slopes
    if slopes is None:
        return np.concatenate([legs[intervals], legs[intervals[:, -1:] + 1]], axis=1)
    start, end = legs[intervals], legs[intervals + 1]
    near, far = slopes[intervals] / 3.0, slopes[intervals + 1] / 3.0
    return np.concatenate([start, start + near, end - far, end[:, -1:]], axis=1)
