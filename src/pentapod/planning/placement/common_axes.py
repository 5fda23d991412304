"""Choice of a common direction of the tool axes, and of the cone around it that they may fill, with the placement.

Candidates are the middle of the path's own axes (the centre of their smallest cap), the workpiece's axis next to it,
and the direction that is up on a table, each with several cones; and the path's own axes as they are. All are compared
by first guesses of the placement; the most promising ones are searched as any other problem is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.progress import Progress, silent
from pentapod.geometry.directions import angle_between, normalised
from pentapod.planning.placement.sampling import SamplingOptions, best_guess
from pentapod.planning.placement.search import Search, SearchOptions
from pentapod.planning.problem.common_axis import CommonAxis
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.weights import NEEDED_MARGIN

Searched = tuple[PlacementProblem, Search]


@dataclass(frozen=True)
class CommonAxesOptions:
    """What is compared.

    tilt: half angle of the cone of the tilt field around the nominal axes, radians. cones_deg: half angles of the cones
    that nominal axes may fill around the common direction. apart_deg: smallest angle between two directions. cap_steps:
    of the iteration for the smallest cap. alike_deg: candidates whose axes differ by less are one. tries, ranked:
    random placements for each candidate, and how many of them are judged with the tilt field. waypoints: number that
    represents the path where the placements are given. starts: of the search of each candidate, the most promising one
    first, then a fixed axis; so many are searched, except those whose first guess is no better than what was found.
    Until a candidate fits, up to `most` are searched, each with up to twice the starts.
    """

    tilt: float = float(np.radians(15.0))
    cones_deg: tuple[float, ...] = (0.0, 10.0, 20.0, 35.0)
    apart_deg: float = 8.0
    cap_steps: int = 400
    alike_deg: float = 1.0
    tries: int = 900
    ranked: int = 6
    waypoints: int = 48
    starts: tuple[int, ...] = (3, 2)
    most: int = 4


OPTIONS = CommonAxesOptions()


def with_common_axis(
    problem: PlacementProblem,
    limit: float,
    search: Callable[[PlacementProblem, SearchOptions], Searched],
    *,
    seed: int = 0,
    progress: Progress = silent,
    options: CommonAxesOptions = OPTIONS,
) -> Searched:
    """Return the problem whose nominal axes give the largest smallest margin, and its search.

    problem: with the path's own axes and the cone of the tilt field; limit: largest angle of the tool from them,
    radians. search: returns a problem, maybe on another machine, and its search. Where the limit leaves no room beyond
    the tilt field, only the path's own axes are searched.
    """
    if limit <= options.tilt:
        return search(problem, SearchOptions())
    progress("tool axis", 0.0, "comparing common directions")
    problems = [problem]
    for direction in directions(problem.samples.nominal, problem.constraints, options):
        for cone in np.radians(options.cones_deg).tolist():
            samples = problem.samples.towards(CommonAxis(direction, cone, limit))
            apart = (angle_between(samples.nominal, other.samples.nominal).max() for other in problems)
            if min(apart) > np.radians(options.alike_deg):
                problems.append(problem.along(samples))
    if len(problems) == 1:
        return search(problem, SearchOptions())
    guessing = SamplingOptions(tries=options.tries, ranked=options.ranked)
    scores = [best_guess(each, seed, guessing, options.waypoints) for each in problems]
    order = sorted(range(len(problems)), key=lambda k: -scores[k])
    fixed = [k for k in order if (axis := problems[k].samples.common_axis) is not None and axis.cone == 0.0][:1]
    order = [*order[:1], *(k for k in fixed if k != order[0]), *(k for k in order[1:] if k not in fixed)]
    best: Searched | None = None
    count = 0
    for k in order:
        fits = best is not None and best[1].best.smallest >= NEEDED_MARGIN
        if best is not None and fits and scores[k] <= best[1].best.smallest:
            continue
        if count >= (len(options.starts) if fits else options.most):
            break
        starts = options.starts[min(count, len(options.starts) - 1)]
        found = search(problems[k], SearchOptions(refined=starts, tried=2 * starts))
        best, count = found if best is None or found[1].best.smallest > best[1].best.smallest else best, count + 1
        if found[1].interrupted:
            break
    if best is None:  # not reached: the first candidate is always searched
        raise RuntimeError("no candidate was searched")
    return best


def directions(own: Floats, constraints: PlacementConstraints, options: CommonAxesOptions = OPTIONS) -> list[Floats]:
    """Return unit directions (3,) to compare for a path's own axes (N, 3), workpiece frame; no two alike."""
    middle = cap_centre(own, options.cap_steps)
    nearest = np.zeros(3)
    largest = int(np.abs(middle).argmax())
    nearest[largest] = np.sign(middle[largest])
    found: list[Floats] = []
    for direction in (constraints.upright, nearest, middle):
        apart = [np.degrees(angle_between(direction, other)) for other in found]
        if np.any(direction) and all(angle >= options.apart_deg for angle in apart):
            found.append(direction)
    return found


def cap_centre(directions: Floats, steps: int = OPTIONS.cap_steps) -> Floats:
    """Return the centre (3,) of about the smallest cap of the sphere that holds unit directions (N, 3).

    Bădoiu and Clarkson 2003: towards the farthest one, by shrinking steps.
    """
    centre = directions.mean(axis=0)
    centre = normalised(centre) if np.linalg.norm(centre) > 1e-6 else directions[0]
    for k in range(1, steps + 1):
        farthest = directions[int((directions @ centre).argmin())]
        moved = centre + (farthest - centre) / (k + 1)
        centre = normalised(moved) if np.linalg.norm(moved) > 1e-9 else centre
    return centre
