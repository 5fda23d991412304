"""reconfigured: where the guides of a reconfigurable machine are to stand, chosen together with the placement.

The guides' slides are five more unknowns of the same problem. Which part of their travel is worth a search is told by
first guesses at a spread of slides; from the best placement found, placement, slides and tilt field climb together, by
sequential quadratic programming on derivatives of the one formulation, whichever solver improves what this led to.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from pentapod.base.arrays import Floats, Ints
from pentapod.base.errors import MachineError
from pentapod.base.progress import Progress, silent
from pentapod.kinematics.robot import Branch
from pentapod.machine.clearance.collision_world import NOTHING, Surroundings
from pentapod.machine.machine import Machine
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.curvature import Curvature
from pentapod.planning.placement.sampling import best_tilted_margins, first_guesses
from pentapod.planning.placement.search import SOLVERS, Search, SolverName, search
from pentapod.planning.problem.formulation import Room, StepSlopes, placement_room, step_slopes, stepped
from pentapod.planning.problem.linear_model import REACH, LinearModel
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.problem.weights import NEEDED_MARGIN

SPREAD = 16
"""So many positions of the guides, all over their travel, are looked at beside where they stand."""

_SAMPLES = 1_500
_ROUNDS, _STEPS = 6, 40
_GAIN, _LEAST = 1e-3, 1e-5
_CONSIDERED = 1_000
_NO_ROWS: Ints = np.zeros(0, dtype=np.intp)
_SLIDE_M = 0.1  # the unit of a slide's step
_DIGITS = 6  # guides are set to the micrometre, so that people can read them and files hold them


def reconfigured(
    problem: PlacementProblem,
    component: Branch | None = None,
    surroundings: Surroundings = NOTHING,
    *,
    seed: int = 0,
    solver: SolverName = "sequential",
    progress: Progress = silent,
) -> tuple[PlacementProblem, Search]:
    """Return the problem with the machine's guides where they are to stand, and what the search there found.

    Never worse than with the guides as they stand. Only slides are taken that the guides reach by moving evenly without
    an architectural singularity on the way. KeyboardInterrupt as in `search`.
    """
    home = problem, search(problem, component, surroundings, seed=seed, solver=solver, progress=progress)
    if home[1].interrupted:
        return home
    best = home
    try:
        other = _promising(problem, component, surroundings, seed, progress)
        if other is not problem:
            found = search(other, component, surroundings, seed=seed, solver=solver, progress=progress)
            best = max(home, (other, found), key=lambda each: each[1].best.smallest)
        for k in range(_ROUNDS):
            there, candidate = best[0], best[1].best
            progress("placement", k / _ROUNDS, f"guides; best margin so far {candidate.smallest:.3f}")
            there, moved = _Climb(there, surroundings).climbed(candidate)
            if moved.smallest < candidate.smallest + _GAIN:
                break
            moved = SOLVERS[solver](there, there.constraints.moves).raise_margin(moved)
            best = there, replace(best[1], best=moved)
    except KeyboardInterrupt:
        if best[1].best.smallest < NEEDED_MARGIN:
            raise
        best = best[0], replace(best[1], interrupted=True)
    return best


def at_slides(problem: PlacementProblem, slides: Floats) -> PlacementProblem | None:
    """Return the problem with its machine's guides at slides (5,); None where they cannot stand or get there."""
    guides = problem.machine.guides
    if guides is None or not guides.stays_regular(np.zeros(5), slides):
        return None
    try:
        return replace(problem, machine=problem.machine.at(slides))
    except MachineError:
        return None


def _promising(
    problem: PlacementProblem, component: Branch | None, surroundings: Surroundings, seed: int, progress: Progress
) -> PlacementProblem:
    """Return the problem whose guides let first guesses of the placement come out best."""
    components = problem.machine.robot.branches if component is None else (component,)
    scores: list[tuple[float, PlacementProblem]] = []
    for k, slides in enumerate([problem.machine.slides, *_spread(problem.machine, seed)]):
        progress("placement", k / SPREAD, "guides")
        there = at_slides(problem, slides)
        if there is not None:
            scores.append((_promise(there, components, surroundings, seed), there))
    return max(scores, key=lambda pair: pair[0])[1] if scores else problem


def _promise(problem: PlacementProblem, components: tuple[Branch, ...], surroundings: Surroundings, seed: int) -> float:
    samples, machine, constraints = problem.samples, problem.machine, problem.constraints
    if constraints.moves:
        guesses = first_guesses(
            samples, machine, components, seed, tries=_SAMPLES, constraints=constraints, surroundings=surroundings
        )
        return max(guess.margin for guess in guesses)
    few = samples.at(samples.representatives(48))
    poses = [(Margins.of(machine, c, surroundings), pose) for c in components for pose in constraints.poses]
    return max(float(best_tilted_margins(few, margins, pose)[0].min()) for margins, pose in poses)


def _spread(machine: Machine, seed: int) -> Floats:
    """Return slides (SPREAD, 5) all over the travel: a Latin hypercube."""
    guides, rng = machine.guides, np.random.default_rng(seed)
    if guides is None:
        return np.zeros((0, 5))
    share = (np.stack([rng.permutation(SPREAD) for _ in range(5)], axis=1) + 0.5) / SPREAD
    least, greatest = guides.travel.T
    return np.round(least + share * (greatest - least), _DIGITS)


@dataclass(eq=False)
class _Climb:
    """Placement, slides and tilt field climb together from a candidate, by sequential quadratic programming."""

    problem: PlacementProblem
    surroundings: Surroundings

    def climbed(self, start: Candidate) -> tuple[PlacementProblem, Candidate]:
        """Return the problem and the candidate that a trust-region method reaches; never a worse one."""
        constraints, problem, best, reach = self.problem.constraints, self.problem, start, 0.5
        slopes = step_slopes(problem, start.margins, guides=True)
        curvature = Curvature(problem, start.margins, guides=True)
        room = placement_room(constraints)
        for _ in range(_STEPS):
            step, change, promise = curvature.best_step(self._model(problem, best, slopes, room), best, reach)
            if promise < _LEAST or reach < _LEAST:
                break
            slides = np.clip(np.round(problem.machine.slides + step[6:], _DIGITS), *self._travel)
            there, gain = at_slides(self.problem, slides), -np.inf
            if there is not None:
                transform = (
                    constraints.nearest_to(stepped(best.transform, step[:6])) if constraints.moves else best.transform
                )
                margins = Margins.of(there.machine, best.margins.component, self.surroundings)
                found = there.candidate(margins, transform, problem.within_cone(best.coefficients + change))
                gain = found.smallest - best.smallest
                if gain > 0.05 * promise:
                    problem, best = there, found
            reach *= 2.0 if gain > 0.6 * promise else 1.0 if gain > 0.25 * promise else 0.4
        return problem, best

    def _model(self, problem: PlacementProblem, at: Candidate, slopes: StepSlopes, room: Room) -> LinearModel:
        values, count = problem.values(at.margins, at.transform, at.coefficients), len(problem.samples.pivots)
        spread = np.linspace(0, count - 1, min(count, _CONSIDERED)).astype(np.intp)
        rows = np.union1d(spread, values.argmin(axis=0))
        placed, by_step = room(at.transform)
        slides, (least, greatest) = problem.machine.slides, self._travel
        left = np.concatenate([placed, slides - least, greatest - slides])
        by_both = _block_diagonal(by_step, np.vstack([np.eye(5), -np.eye(5)]))
        moves = _block_diagonal(REACH[:, None] * problem.constraints.motion, _SLIDE_M * np.eye(5))
        return LinearModel.of(problem, at, rows, at.smallest, _NO_ROWS, slopes, (left, by_both), moves)

    @property
    def _travel(self) -> Floats:
        guides = self.problem.machine.guides
        return np.zeros((2, 5)) if guides is None else guides.travel.T


def _block_diagonal(first: Floats, second: Floats) -> Floats:
    return np.asarray(block_diag(first, second), dtype=np.float64)
