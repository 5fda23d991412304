"""Multi-start search for the placement and component whose smallest margin is largest; it can be interrupted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from typing import Literal, Protocol

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.progress import Progress, silent
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.robot import Branch
from pentapod.machine.clearance.collision_world import NOTHING
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.ipopt import IpoptSolver
from pentapod.planning.placement.sampling import first_candidate, first_guesses, fitted_gaps
from pentapod.planning.placement.sequential import SequentialSolver
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.problem.weights import NEEDED_MARGIN

SolverName = Literal["sequential", "ipopt"]


@dataclass(frozen=True)
class SearchOptions:
    """How many first guesses are improved.

    refined: number in any case. tried: maximum while none is good enough. hopeless: where all guesses are below this
    margin, the search is first made without obstacles. beyond_reach: best margin after the first `refined` starts below
    which no other start is expected to lead to a placement that fits. waypoints: used in every step from a given start.
    polished: whether the best is improved until nothing is gained also where it fits.
    """

    refined: int = 4
    tried: int = 10
    hopeless: float = -0.5
    beyond_reach: float = -0.1
    waypoints: int = 600
    polished: bool = True


Start = tuple[Margins, RigidTransform]


class Solver(Protocol):
    """A local solver: `sequential`, the default, or `ipopt`, the reference."""

    def raise_margin(
        self, start: Candidate, enough: float = np.inf, others: Sequence[Candidate] | None = None
    ) -> Candidate:
        """Return a candidate near `start` whose smallest margin is largest, or with `enough`; never a worse one.

        others: candidates found before, with which it is compared; it may end early then.
        """
        ...

    def smooth(self, start: Candidate, keep: float, progress: Progress = silent) -> Floats | None:
        """Return coefficients (K, 2) of the smoothest spline of the axes that keeps the margin `keep`, or None.

        Placement and first leans are those of `start`.
        """
        ...


SOLVERS: dict[SolverName, Callable[[PlacementProblem, bool], Solver]] = {
    "sequential": SequentialSolver,
    "ipopt": IpoptSolver,
}
"""The solvers by name, made of a problem and whether the placement is free."""


@dataclass(frozen=True, eq=False)
class Search:
    """The result of a search: the best candidate, number of starts tried and in all, whether it was interrupted."""

    best: Candidate
    tried: int
    starts: int
    interrupted: bool
    constraints: PlacementConstraints

    @property
    def choice(self) -> str:
        """The reason for the choice of the placement, in words."""
        poses, aim = self.constraints.poses, "the one with the most room to the limits"
        if len(poses) > 1:
            aim = f"pose {1 + poses.index(self.best.transform)} of {len(poses)} of the fixture: {aim}"
        if self.interrupted:
            return f"{aim}, the search interrupted after {self.tried} of up to {self.starts} starts"
        return "job" if len(poses) == 1 else aim


def search(
    problem: PlacementProblem,
    *,
    seed: int = 0,
    solver: SolverName = "sequential",
    progress: Progress = silent,
    options: SearchOptions = SearchOptions(),
) -> Search:
    """Return the best allowed placement that was found.

    KeyboardInterrupt ends the search early; it is raised where no placement that fits was found before.
    """
    constraints, best, tried, count, interrupted = problem.constraints, None, 0, 1, False
    try:
        starts = _starts(problem, seed, progress)
        first, best_guess = next(starts)
        if best_guess < options.hopeless and problem.margins[0].scene.collision_world is not NOTHING:
            # A part that does not fit without obstacles does not fit with them; that search is much faster.
            alone = search(
                problem.without_collision_world(), seed=seed, solver=solver, progress=progress, options=options
            )
            if alone.best.smallest < NEEDED_MARGIN:
                return alone
            if alone.interrupted:
                raise KeyboardInterrupt
        count = options.tried if constraints.moves else len(problem.margins) * len(constraints.poses)
        others = list[Candidate]()
        improver, gaps = SOLVERS[solver](problem, constraints.moves), fitted_gaps(problem)
        for (margins, transform), _ in islice(chain([(first, best_guess)], starts), count):
            if constraints.moves and tried >= options.refined and best is not None and _is_decided(best, options):
                break
            found = improver.raise_margin(first_candidate(problem, margins, transform, gaps), others=others)
            others.append(found)
            best = found if best is None or problem.rank(found) > problem.rank(best) else best
            tried += 1
            note = f"component {best.margins.scene.branch}, best margin so far {best.smallest:.3f}"
            progress("placement", tried / count, note)
        # Compared roughly, the best may be just short of the margin that is needed.
        rough = best is not None and (options.polished or best.smallest < NEEDED_MARGIN)
        if rough and best is not None and best.smallest >= options.beyond_reach:
            best = improver.raise_margin(best)
    except KeyboardInterrupt:
        if best is None or best.smallest < NEEDED_MARGIN:
            raise
        interrupted = True
        kept = f"the best so far is kept, margin {best.smallest:.3f}; once more ends it"
        progress("placement", 1.0, f"interrupted: {kept}")
    if best is None:  # not reached: there are components, and first_guesses returns some for each
        raise RuntimeError("no first guess was made")
    return Search(best, tried, count, interrupted, constraints)


def improved_from(
    problem: PlacementProblem, branch: Branch, transform: RigidTransform, options: SearchOptions = SearchOptions()
) -> Search:
    """Return the search from one start alone: an allowed placement near `transform`, in a branch of the problem."""
    margins = next(each for each in problem.margins if each.scene.branch == branch)
    first = first_candidate(problem, margins, problem.constraints.nearest_to(transform), fitted_gaps(problem))
    rows = np.sort(problem.samples.representatives(options.waypoints))
    best = SequentialSolver(problem, problem.constraints.moves, rows=rows).raise_margin(first)
    return Search(best, 1, 1, False, problem.constraints)


def _is_decided(best: Candidate, options: SearchOptions) -> bool:
    return best.smallest >= NEEDED_MARGIN or best.smallest < options.beyond_reach


def _starts(problem: PlacementProblem, seed: int, progress: Progress) -> Iterator[tuple[Start, float]]:
    """Yield the starts, each with its margin (∞ where the placements are given), the best first."""
    if not problem.constraints.moves:
        yield from (((margins, pose), np.inf) for pose in problem.constraints.poses for margins in problem.margins)
        return
    progress("placement", 0.0, "sampling")
    yield from (((guess.margins, guess.transform), guess.margin) for guess in first_guesses(problem, seed))
