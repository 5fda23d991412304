"""Claims on exact stops and dwells: the robot is at rest where the toolpath asks for it, and for as long."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools
from pentapod.geometry.directions import angle_between
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.runs import marked_runs
from pentapod.verify.replay.claim import MM, Claim, Finding, Idle
from pentapod.verify.replay.replay import Replay

STILL_M = 1e-9
"""A leg that moves by no more from row to row is at rest: the resolution of the coarsest program files, metres."""

DWELL_TOLERANCE_S = 1e-9


def exact_stops(replay: Replay) -> Finding | Idle:
    """Judge that the robot is at rest at every exact stop of the toolpath."""
    stops = required_stops(replay)
    if not stops:
        return Idle("the toolpath has no exact stop")
    period, limit = replay.program.period, replay.machine.legs.max_acceleration
    shares = (np.abs(np.diff(replay.program.legs, axis=0)) / limit).max(axis=1)
    slowest = [low + int(np.argmin(shares[low:high])) for low, high, _ in stops]
    worst = slowest[int(np.argmax(shares[slowest]))]
    step = np.abs(replay.program.legs[worst + 1] - replay.program.legs[worst])
    leg = int(np.argmax(step / limit))
    value, bound = float(step[leg]) / period, float(limit[leg]) * period
    method = (
        f"largest leg speed at {len(stops)} exact stops, each in its slowest period within the path tolerance; the "
        f"bound is the change of speed of leg {leg + 1} at its largest acceleration in one period"
    )
    return Finding.at_most(value, bound, MM, "mm/s", replay.place(2 * worst), method)


def dwells(replay: Replay) -> Finding | Idle:
    """Judge that the robot is at rest as long as the toolpath asks for."""
    required = [stop for stop in required_stops(replay) if stop[2] > 0.0]
    if not required:
        return Idle("the toolpath has no dwell")
    still = np.abs(np.diff(replay.program.legs, axis=0)).max(axis=1) <= STILL_M
    rests = [_longest_run(still[low:high]) * replay.program.period for low, high, _ in required]
    worst = int(np.argmin(np.array(rests) - [seconds for _, _, seconds in required]))
    value, bound = rests[worst], required[worst][2]
    method = (
        f"dwell with the largest shortfall, of {len(required)}: longest time in which no leg moves more than "
        f"{MM * STILL_M:g} mm from row to row, within the path tolerance of the place"
    )
    passed, where = value >= bound - DWELL_TOLERANCE_S, replay.place(2 * required[worst][0])
    return Finding(passed, value, bound, "s", where, method, at_least=True)


def required_stops(replay: Replay) -> list[tuple[int, int, float]]:
    """Return (first, end, seconds) of each stop: the range of steps between rows near it, and its dwell."""
    path, match, count = replay.toolpath, replay.match, len(replay.program.legs) - 1
    # Where the tool turns on the spot, arc length does not distinguish one waypoint from the next; turning does.
    turns = np.append(0.0, np.cumsum(angle_between(path.axes[:-1], path.axes[1:])))
    measures = (
        (match.arcs[::2], arc_length(path.tilt_centres)[path.starts], replay.match_radius),
        (match.turned[::2], turns[path.starts], replay.specification.axis_tolerance),
    )
    low = np.maximum(*(np.searchsorted(measure, places - within, "left") for measure, places, within in measures))
    high = np.minimum(*(np.searchsorted(measure, places + within, "right") for measure, places, within in measures))
    # Where fewer than two rows are near, because the program jumps over the place, all steps that touch it count.
    few = high - low < 2
    first = np.clip(np.where(few, np.minimum(low, high) - 1, low), 0, count - 1)
    behind = np.clip(np.where(few, np.maximum(low, high), high - 1), first + 1, count)
    return [
        (a, b, seconds)
        for a, b, seconds in zip(first.tolist(), behind.tolist(), path.dwells, strict=True)
        if seconds is not None
    ]


def _longest_run(flags: Bools) -> int:
    """Return the length of the longest run of flags that are set."""
    return int(np.diff(marked_runs(flags)).max(initial=0))


CLAIMS = (
    Claim("exact stops", exact_stops),
    Claim("dwells", dwells),
)
