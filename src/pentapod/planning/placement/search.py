"""search: the placement and component with the largest smallest margin, from many starts; it can be interrupted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.progress import Progress, silent
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.robot import Branch
from pentapod.machine.clearance.collision_world import NOTHING, Surroundings
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.ipopt import IpoptSolver
from pentapod.planning.placement.sampling import first_candidate, first_guesses
from pentapod.planning.placement.sequential import SequentialSolver
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.problem.weights import NEEDED_MARGIN

SolverName = Literal["sequential", "ipopt"]

HOPELESS = -0.5
"""First guesses all below this smallest margin: whether the part fits with nothing around it is looked at first."""

REFINED = 4
"""How many first guesses are improved in any case."""

TRIED = 10
"""How many are improved at most, while none is good enough."""

BEYOND_REACH = -0.1
"""A best smallest margin, after the first few, from which no other start is expected to lead to one that fits."""

Start = tuple[Margins, RigidTransform]


class Solver(Protocol):
    """What improves candidates: `sequential`, the default, and `ipopt`, the reference."""

    def raise_margin(self, start: Candidate, enough: float = np.inf) -> Candidate:
        """Return a candidate near `start` with the largest smallest margin, or with `enough`; never a worse one."""
        ...

    def smooth(self, start: Candidate, keep: float) -> Floats | None:
        """Return coefficients (K, 2) of the smoothest spline of the axes that keeps the margin `keep`.

        At the placement of `start`, and from its leans on. None where no such spline was found.
        """
        ...


SOLVERS: dict[SolverName, Callable[[PlacementProblem, bool], Solver]] = {
    "sequential": SequentialSolver,
    "ipopt": IpoptSolver,
}
"""By name: from a problem, and whether the placement may move."""


@dataclass(frozen=True, eq=False)
class Search:
    """What a search found: the best candidate, how many of how many starts it improved, whether it was interrupted."""

    best: Candidate
    tried: int
    starts: int
    interrupted: bool
    constraints: PlacementConstraints

    @property
    def choice(self) -> str:
        """What the placement was chosen by, in words."""
        poses, aim = self.constraints.poses, "largest smallest margin"
        if len(poses) > 1:
            aim = f"pose {1 + poses.index(self.best.transform)} of {len(poses)} of the fixture: {aim}"
        if self.interrupted:
            return f"{aim}, the search interrupted after {self.tried} of up to {self.starts} starts"
        return "job" if len(poses) == 1 else aim


def search(
    problem: PlacementProblem,
    component: Branch | None = None,
    surroundings: Surroundings = NOTHING,
    *,
    seed: int = 0,
    solver: SolverName = "sequential",
    progress: Progress = silent,
) -> Search:
    """Return the best allowed placement that was found, in the component given or in any.

    KeyboardInterrupt ends the search early; it is raised where nothing that fits was found until then.
    """
    constraints, best, tried, count, interrupted = problem.constraints, None, 0, 1, False
    try:
        starts, promise = _starts(problem, component, surroundings, seed, progress)
        if promise < HOPELESS and surroundings is not NOTHING:
            # What does not fit with nothing around does not fit; that is found much sooner.
            alone = search(problem, component, seed=seed, solver=solver, progress=progress)
            if alone.best.smallest < NEEDED_MARGIN:
                return alone
            if alone.interrupted:
                raise KeyboardInterrupt
        count = min(len(starts), TRIED) if constraints.moves else len(starts)
        improver = SOLVERS[solver](problem, constraints.moves)
        for margins, transform in starts[:count]:
            if constraints.moves and tried >= REFINED and best is not None and _is_decided(best):
                break
            found = improver.raise_margin(first_candidate(problem, margins, transform))
            best = found if best is None or found.smallest > best.smallest else best
            tried += 1
            note = f"component {best.margins.component}, best margin so far {best.smallest:.3f}"
            progress("placement", tried / count, note)
    except KeyboardInterrupt:
        if best is None or best.smallest < NEEDED_MARGIN:
            raise
        interrupted = True
        progress("placement", 1.0, f"interrupted: the best so far is kept, margin {best.smallest:.3f}")
    if best is None:  # there are components, and first_guesses returns some for each
        raise RuntimeError("no first guess was made")
    return Search(best, tried, count, interrupted, constraints)


def _is_decided(best: Candidate) -> bool:
    return best.smallest >= NEEDED_MARGIN or best.smallest < BEYOND_REACH


def _starts(
    problem: PlacementProblem, component: Branch | None, surroundings: Surroundings, seed: int, progress: Progress
) -> tuple[list[Start], float]:
    """Return where to start, and the smallest margin of the most promising guess (∞ where nothing is guessed)."""
    components, machine, constraints = (
        problem.machine.robot.branches if component is None else (component,),
        problem.machine,
        problem.constraints,
    )
    if not constraints.moves:
        return [(Margins.of(machine, c, surroundings), pose) for pose in constraints.poses for c in components], np.inf
    progress("placement", 0.0, "sampling")
    guesses = first_guesses(
        problem.samples, machine, components, seed, constraints=constraints, surroundings=surroundings
    )
    margins = {c: Margins.of(machine, c, surroundings) for c in components}
    starts = [(margins[guess.component], guess.transform) for guess in guesses]
    return starts, max(g.margin for g in guesses)
