"""Base reconfiguration: rail positions of a reconfigurable machine, optimised together with the placement.

Rail positions are further unknowns of the same problem. First guesses at a Latin hypercube of them select where a
second search is made. From the better of both, placement, rail positions and tilt field are improved together by
sequential quadratic programming.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.progress import Progress, silent
from pentapod.machine.machine import Machine
from pentapod.planning.placement.rail_positions import DIGITS, at_rail_positions, guides_of
from pentapod.planning.placement.sampling import SamplingOptions, best_guess
from pentapod.planning.placement.search import SOLVERS, Search, SolverName, search
from pentapod.planning.placement.sequential import SequentialSolver
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.weights import NEEDED_MARGIN


@dataclass(frozen=True)
class ReconfigurationOptions:
    """Effort of the search for rail positions.

    spread: positions all over the travel that are compared, besides the present ones. tries: random placements for each
    of them. waypoints: number that represents the path where the placements are given. rounds: joint improvements at
    most. gain: least increase of the smallest margin for which another round is made.
    """

    spread: int = 16
    tries: int = 1_500
    waypoints: int = 48
    rounds: int = 6
    gain: float = 1e-3


def reconfigured(
    problem: PlacementProblem,
    *,
    seed: int = 0,
    solver: SolverName = "sequential",
    progress: Progress = silent,
    options: ReconfigurationOptions = ReconfigurationOptions(),
) -> tuple[PlacementProblem, Search]:
    """Return the problem at the best rail positions found, and the search there.

    Never worse than at the present rail positions. Every position is reached on a straight line from the home position
    without an architectural singularity on the way. Raises MachineError for a machine without guides,
    KeyboardInterrupt as in `search`.
    """
    guides_of(problem.machine)
    home = problem, search(problem, seed=seed, solver=solver, progress=progress)
    if home[1].interrupted:
        return home
    best = home
    try:
        other = _promising(problem, seed, progress, options)
        if other is not problem:
            found = search(other, seed=seed, solver=solver, progress=progress)
            best = max(home, (other, found), key=lambda each: each[1].best.smallest)
        for k in range(options.rounds):
            there, candidate = best[0], best[1].best
            progress("placement", k / options.rounds, f"guides; best margin so far {candidate.smallest:.3f}")
            moved = SequentialSolver(there, there.constraints.moves, guides=True).raise_margin(candidate)
            if moved.smallest < candidate.smallest + options.gain:
                break
            there = there.on(moved.margins.scene.machine)
            moved = SOLVERS[solver](there, there.constraints.moves).raise_margin(moved)
            best = there, replace(best[1], best=moved)
    except KeyboardInterrupt:
        if best[1].best.smallest < NEEDED_MARGIN:
            raise
        best = best[0], replace(best[1], interrupted=True)
        kept = f"the best so far is kept, margin {best[1].best.smallest:.3f}; once more ends it"
        progress("placement", 1.0, f"interrupted: {kept}")
    return best


def _promising(
    problem: PlacementProblem, seed: int, progress: Progress, options: ReconfigurationOptions
) -> PlacementProblem:
    """Return the problem at the rail positions with the best first guess of the placement."""
    guessing = SamplingOptions(tries=options.tries)
    scores = [(best_guess(problem, seed, guessing, options.waypoints), problem)]
    for k, positions in enumerate(_spread(problem.machine, seed, options.spread)):
        progress("placement", k / options.spread, "guides")
        margins = at_rail_positions(problem.margins[0], positions)
        if margins is not None:
            there = problem.on(margins.scene.machine)
            scores.append((best_guess(there, seed, guessing, options.waypoints), there))
    return max(scores, key=lambda pair: pair[0])[1]


def _spread(machine: Machine, seed: int, count: int) -> Floats:
    """Return rail positions (count, n) all over the travel: a Latin hypercube."""
    rng, (least, greatest) = np.random.default_rng(seed), guides_of(machine).travel.T
    share = (np.stack([rng.permutation(count) for _ in least], axis=1) + 0.5) / count
    return np.round(least + share * (greatest - least), DIGITS)
