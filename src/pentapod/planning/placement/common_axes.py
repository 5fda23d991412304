"""Choice of a common direction of the tool axes, and of the cone around it that they may fill, with the placement.

Candidates are the middle of the path's own axes (the centre of their smallest cap), the workpiece's axis next to it,
and the direction that is up on a table, each with several cones; and the path's own axes as they are. All are compared
at a few hundred waypoints: by first guesses of the placement, and by the room that shank and holder have over the part.
The most promising ones are searched at these waypoints, and the best is improved at all of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.progress import Progress, silent
from pentapod.geometry.directions import angle_between, normalised
from pentapod.planning.placement.sampling import SamplingOptions, best_guess
from pentapod.planning.placement.search import Search, SearchOptions
from pentapod.planning.placement.sequential import SequentialSolver
from pentapod.planning.problem.common_axis import CommonAxis
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.tool_access import tool_access
from pentapod.planning.problem.weights import NEEDED_MARGIN

Searched = tuple[PlacementProblem, Search]


@dataclass(frozen=True)
class CommonAxesOptions:
    """What is compared.

    tilt: half angle of the cone of the tilt field around the nominal axes, radians. cones_deg: half angles of the cones
    that nominal axes may fill around the common direction. apart_deg: smallest angle between two directions. cap_steps:
    of the iteration for the smallest cap. alike_deg: candidates whose axes differ by less are one. compared: waypoints
    at which candidates are compared and searched. tries, ranked: random placements for each candidate, and how many of
    them are judged with the tilt field. waypoints: number that represents the path where the placements are given.
    starts: of the search of each candidate, the most promising one first, then a fixed axis; so many are searched,
    except those whose first guess is no better than what was found. Until a candidate fits, up to `most` are searched,
    each with up to twice the starts. room: expected margin of shank and holder below which only the most promising
    candidate is searched: at some waypoint they touch at every lean that was tried. own: whether the path's own axes
    are a candidate.
    """

    tilt: float = float(np.radians(15.0))
    cones_deg: tuple[float, ...] = (0.0, 10.0, 20.0, 35.0)
    apart_deg: float = 8.0
    cap_steps: int = 400
    alike_deg: float = 1.0
    compared: int = 600
    tries: int = 900
    ranked: int = 6
    waypoints: int = 48
    starts: tuple[int, ...] = (3, 2)
    most: int = 4
    room: float = 0.0
    own: bool = True


OPTIONS = CommonAxesOptions()

FIXED = CommonAxesOptions(tilt=0.0, cones_deg=(0.0,), own=False)
"""The tool keeps one direction everywhere."""


def with_common_axis(
    problem: PlacementProblem,
    limit: float,
    search: Callable[[PlacementProblem, SearchOptions], Searched],
    *,
    without_idle: Callable[[PlacementProblem], PlacementProblem] = lambda problem: problem,
    seed: int = 0,
    progress: Progress = silent,
    options: CommonAxesOptions = OPTIONS,
) -> Searched:
    """Return the problem whose nominal axes make the smallest margin largest, and its search.

    problem: with the path's own axes and the cone of the tilt field; limit: largest angle of the tool from them,
    radians. search: returns a problem, maybe on another machine, and its search. without_idle: leaves bodies of the
    tool out of a problem that cannot be limits of it. Where the limit leaves no room beyond the tilt field, only the
    path's own axes are searched.
    """
    if limit <= options.tilt:
        return search(without_idle(problem), SearchOptions())
    progress("tool axis", 0.0, "comparing common directions")
    problems = candidates(problem, limit, options)
    if len(problems) == 1:
        return search(without_idle(problems[0]), SearchOptions())
    rows = np.sort(problem.samples.representatives(options.compared))
    scores = [promise(each.at(rows), seed, options) for each in problems]
    order = sorted(range(len(problems)), key=lambda k: scores[k], reverse=True)
    fixed = [k for k in order if (axis := problems[k].samples.common_axis) is not None and axis.cone == 0.0][:1]
    order = [*order[:1], *(k for k in fixed if k != order[0]), *(k for k in order[1:] if k not in fixed)]
    found: list[tuple[PlacementProblem, Searched]] = []
    best = -np.inf
    for k in order:
        fits = best >= NEEDED_MARGIN
        if fits and scores[k][0] <= best:
            continue
        if len(found) >= (len(options.starts) if fits else options.most):
            break
        if found and scores[k][0] < options.room:
            continue
        starts = options.starts[min(len(found), len(options.starts) - 1)]
        whole = without_idle(problems[k])
        found.append((whole, search(whole.at(rows), SearchOptions(refined=starts, tried=2 * starts, polished=False))))
        best = max(best, found[-1][1][1].best.smallest)
        if found[-1][1][1].interrupted:
            break
    found.sort(key=lambda pair: pair[1][0].rank(pair[1][1].best), reverse=True)
    done: list[Searched] = []
    for whole, few in found:
        best = max((each[1].best.smallest for each in done), default=-np.inf)
        if done and (best >= NEEDED_MARGIN or few[1].best.smallest < NEEDED_MARGIN):
            break
        done.append(everywhere(whole, few, rows))
    return max(done, key=lambda pair: pair[1].best.smallest)


def candidates(problem: PlacementProblem, limit: float, options: CommonAxesOptions = OPTIONS) -> list[PlacementProblem]:
    """Return the problem and those with common directions and cones, no two alike."""
    found = [problem] if options.own else []
    for direction in directions(problem.samples.nominal, problem.constraints, options):
        for cone in np.radians(options.cones_deg).tolist():
            samples = problem.samples.towards(CommonAxis(direction, cone, limit))
            apart = (angle_between(samples.nominal, other.samples.nominal).max() for other in found)
            if min(apart, default=np.inf) > np.radians(options.alike_deg):
                found.append(problem.along(samples))
    return found


def promise(problem: PlacementProblem, seed: int = 0, options: CommonAxesOptions = OPTIONS) -> tuple[float, float]:
    """Return about the largest margin to expect of a problem, and that without shank and holder.

    Their room over the part does not depend on the placement, first guesses of which are made without them.
    """
    world = problem.margins[0].scene.collision_world
    guessing = SamplingOptions(tries=options.tries, ranked=options.ranked)
    guess = best_guess(problem.in_world(replace(world, tool=())), seed, guessing, options.waypoints)
    return min(guess, float(tool_access(problem.samples, world).min())), guess


def everywhere(whole: PlacementProblem, found: Searched, rows: Ints) -> Searched:
    """Return the search of a problem at the waypoints `rows`, improved at all waypoints of the whole problem."""
    few, search = found
    whole = whole if few.machine is whole.machine else whole.on(few.machine)
    start = whole.candidate(search.best.margins, search.best.transform, search.best.coefficients)
    if search.best.smallest < NEEDED_MARGIN:  # at more waypoints it is no larger
        return whole, replace(search, best=start)
    best = SequentialSolver(whole, whole.constraints.moves, rows=rows).raise_margin(start)
    return whole, replace(search, best=best)


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
