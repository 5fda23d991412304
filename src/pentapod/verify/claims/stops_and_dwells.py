"""Claims about where the toolpath asks for a stop: that the robot comes to rest there, and stands for so long."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Bools
from pentapod.geometry.directions import angle_between
from pentapod.geometry.polyline import arc_length
from pentapod.geometry.runs import marked_runs
from pentapod.verify.replay.claim import MM, Claim, Finding, Idle, with_allowance
from pentapod.verify.replay.replay import Replay

STILL_M = 1e-9
"""A leg that moves by less from row to row stands: the resolution of the coarsest program files."""

_SECONDS = 1e-9


def exact_stops(replay: Replay) -> Finding | Idle:
    """Judge that the robot comes to rest wherever the toolpath stops."""
    stops = asked_stops(replay)
    if not stops:
        return Idle("the toolpath asks for no stop")
    period, limit = replay.program.period, replay.machine.legs.max_acceleration
    shares = (np.abs(np.diff(replay.program.legs, axis=0)) / limit).max(axis=1)
    slowest = [low + int(np.argmin(shares[low:high])) for low, high, _ in stops]
    worst = slowest[int(np.argmax(shares[slowest]))]
    step = np.abs(replay.program.legs[worst + 1] - replay.program.legs[worst])
    leg = int(np.argmax(step / limit))
    value, bound = float(step[leg]) / period, float(limit[leg]) * period
    method = (
        f"of {len(stops)} stops the one where most is left of the legs' speed, over the slowest period within the path "
        f"tolerance of it; the bound is what leg {leg + 1}'s greatest acceleration changes in one period"
    )
    allowed = with_allowance(bound)
    place = replay.place(2 * worst)
    return Finding(value <= allowed, MM * value, MM * bound, "mm/s", place, method, MM * allowed)


def dwells(replay: Replay) -> Finding | Idle:
    """Judge that the robot stands as long as the toolpath asks."""
    asked = [stop for stop in asked_stops(replay) if stop[2] > 0.0]
    if not asked:
        return Idle("the toolpath asks for no dwell")
    still = np.abs(np.diff(replay.program.legs, axis=0)).max(axis=1) <= STILL_M
    stood = [_longest_run(still[low:high]) * replay.program.period for low, high, _ in asked]
    worst = int(np.argmin(np.array(stood) - [seconds for _, _, seconds in asked]))
    value, bound = stood[worst], asked[worst][2]
    method = (
        f"of {len(asked)} dwells the one that falls short most, or is exceeded least: the longest time without a leg "
        f"moving more than {MM * STILL_M:g} mm from row to row, within the path tolerance of the place"
    )
    return Finding(value >= bound - _SECONDS, value, bound, "s", replay.place(2 * asked[worst][0]), method)


def asked_stops(replay: Replay) -> list[tuple[int, int, float]]:
    """Return for each stop of the toolpath the steps from row to row, from and to before, near it; and its seconds."""
    path, match, count = replay.toolpath, replay.match, len(replay.program.legs) - 1
    # Where the tool turns on the spot its way does not tell one waypoint from the next.
    turns = np.append(0.0, np.cumsum(angle_between(path.axes[:-1], path.axes[1:])))
    courses = (
        (match.arcs[::2], arc_length(path.tilt_centres)[path.starts], replay.path_tolerance),
        (match.turned[::2], turns[path.starts], replay.axis_tolerance),
    )
    low = np.maximum(*(np.searchsorted(course, places - within, "left") for course, places, within in courses))
    high = np.minimum(*(np.searchsorted(course, places + within, "right") for course, places, within in courses))
    # Where fewer than two rows are near, as where a program jumps over the place, all steps that touch it count.
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
