"""Leans whose tool is clear of the part between waypoints, too.

Margins are those at waypoints. On the way to the next one the axis turns, and beside an edge the tool may come nearer
to the part than at both. There the waypoints beside it get more room.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.progress import Progress, silent
from pentapod.planning.placement.own_leans import ENOUGH, asked, restored_along_spline
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.tool_axis.smoothing_options import OPTIONS as SMOOTHING

Ranges = Sequence[tuple[int, int]]


@dataclass(frozen=True)
class RoomOptions:
    """Options of the room. first: margin that is added at first; more: factor on it where that is not enough.

    rounds: of this. beside: waypoints on either side that get it, too.
    """

    first: float = 0.1
    more: float = 2.0
    rounds: int = 4
    beside: int = 1


OPTIONS = RoomOptions()


def clear_between(
    problem: PlacementProblem,
    at: Candidate,
    leans: Floats,
    meetings: Callable[[Floats], Ranges],
    progress: Progress = silent,
) -> Floats:
    """Return leans (N, 3) near those given that keep the tool clear of the part between waypoints.

    meetings: returns the ranges of waypoints, inclusive, between which the tool meets the part. Where it does so with
    all leans that are found, those are returned with which it does at the fewest waypoints.
    """
    options, spare, keep = OPTIONS, np.zeros(len(leans)), 0.0
    found, best, fewest = leans, leans, np.inf
    for k in range(options.rounds + 1):
        met = meetings(found)
        if (count := sum(last - first for first, last in met)) < fewest:
            best, fewest = found, count
        if not met or k == options.rounds:
            break
        if k == 0:
            smallest = float(problem.values_of(at.margins, at.transform, leans).min())
            keep = float(np.clip(smallest, ENOUGH, asked()))
        short = np.zeros(len(leans), dtype=np.bool_)
        for first, last in met:
            short[max(first - options.beside, 0) : last + options.beside + 1] = True
        spare = np.where(short, np.maximum(options.first, options.more * spare), spare)
        again = restored_along_spline(replace(problem, spare=spare), at, keep, found, progress)
        if again is None or problem.values_of(at.margins, at.transform, again).min() < ENOUGH - SMOOTHING.slack:
            break
        found = again
    return best
