"""The default placement solver: sequential quadratic programming with a trust region, for the max-min problem.

Each program holds only the smallest margins, at the waypoints where they are smallest (Fletcher, Practical Methods of
Optimization, ch. 14: minimax). Every step is judged by the margins themselves: a poor model costs a step, no limit.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.rigid import RigidTransform
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.curvature import Curvature
from pentapod.planning.placement.rail_positions import STEP_M, at_rail_positions, with_guides, with_travel
from pentapod.planning.problem.formulation import Room, StepSlopes, placement_room, step_slopes, stepped
from pentapod.planning.problem.linear_model import REACH, LinearModel, valleys
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.tool_axis.smoothing import smoothed

_NO_ROWS: Ints = np.zeros(0, dtype=np.intp)


@dataclass(frozen=True)
class SequentialOptions:
    """When the iteration ends, and at how many waypoints margins are computed.

    waypoints: at most so many are used in every step; all are checked when the steps have ended. steps, rounds: at most
    so many steps, and checks at all waypoints. tolerance: a smallest margin over all waypoints that is lower by more
    than this calls for another round. least: smaller predicted gains, and smaller trust regions, end the steps.
    """

    waypoints: int = 4000
    steps: int = 60
    rounds: int = 6
    tolerance: float = 1e-4
    least: float = 1e-5


@dataclass(eq=False)
class SequentialSolver:
    """Improves candidates of one problem. free, guides: whether the placement and the machine's guides may move."""

    problem: PlacementProblem
    free: bool
    guides: bool = False
    options: SequentialOptions = SequentialOptions()

    def raise_margin(self, start: Candidate, enough: float = np.inf) -> Candidate:
        """Return a candidate with the largest smallest margin near `start`, or with `enough`; never a worse one."""
        rows, best = self._waypoints(), start
        for _ in range(self.options.rounds):
            found = self._climb(best, rows, enough + self.options.tolerance)
            values = self.problem.values(found.margins, found.transform, found.coefficients)
            smallest = float(values.min())
            if smallest > best.smallest:
                best = Candidate(found.margins, found.transform, found.coefficients, smallest)
            if smallest >= found.smallest - self.options.tolerance:
                break
            rows = np.union1d(rows, np.argsort(values.min(axis=1), kind="stable")[: self.options.waypoints // 8])
        return best

    def smooth(self, start: Candidate, keep: float) -> Floats | None:
        """Return coefficients (K, 2) of the smoothest spline at the placement of `start` that keeps `keep`."""
        return smoothed(self.problem, start, keep)

    def _waypoints(self) -> Ints:
        count = len(self.problem.samples.tilt_centres)
        return np.unique(np.linspace(0, count - 1, min(count, self.options.waypoints)).astype(np.intp))

    def _climb(self, start: Candidate, rows: Ints, enough: float) -> Candidate:
        """Return the candidate that a trust-region method reaches, with its smallest margin over `rows`."""
        problem, reach, extra = self.problem, 0.5, _NO_ROWS
        smallest = float(problem.values(start.margins, start.transform, start.coefficients, rows).min())
        best = Candidate(start.margins, start.transform, start.coefficients, smallest)
        slopes = step_slopes(problem, start.margins, guides=self.guides)
        curvature = Curvature(problem, start.margins, self.guides)
        model = self.model(best, rows, best.smallest, slopes=slopes)
        for _ in range(self.options.steps):
            if best.smallest >= enough:
                break
            step, change, promise = curvature.best_step(model, best, reach)
            if promise < self.options.least:
                break
            coefficients, values, gain = problem.within_cone(best.coefficients + change), np.zeros((0, 1)), -np.inf
            moved = self._moved(best, step)
            if moved is not None:
                values = problem.values(*moved, coefficients, rows)
                gain = float(values.min()) - best.smallest
            reach *= 2.0 if gain > 0.6 * promise else 1.0 if gain > 0.25 * promise else 0.4
            if moved is not None and gain > 0.05 * promise:
                best = Candidate(*moved, coefficients, float(values.min()))
            elif reach < self.options.least:
                break
            elif moved is not None:  # what came out worst may not have been in the model
                steepness = problem.steepness(best.coefficients + change, rows)
                extra = np.union1d(extra, np.union1d(valleys(values), valleys(-steepness[:, None])))
            model = self.model(best, rows, best.smallest, extra, slopes)
        return best

    def _moved(self, at: Candidate, step: Floats) -> tuple[Margins, RigidTransform] | None:
        """Return margins and placement after a step; None where the guides cannot stand there, or get there."""
        transform, margins = at.transform, at.margins
        if self.free:
            transform = self.problem.constraints.nearest_to(stepped(transform, step[:6]))
        if self.guides:
            there = at_rail_positions(margins, margins.machine.rail_positions + step[6:])
            return None if there is None else (there, transform)
        return margins, transform

    def model(
        self, at: Candidate, rows: Ints, level: float, extra: Ints = _NO_ROWS, slopes: StepSlopes | None = None
    ) -> LinearModel:
        """Return the linear model around a candidate of what comes near a margin of `level` among `rows`.

        extra: indices into rows that enter in any case. slopes: of the margins; those of the candidate by default.
        """
        slopes = step_slopes(self.problem, at.margins) if slopes is None else slopes
        room = self._room(at.transform)
        if self.guides:
            room = with_travel(at.margins.machine, room)
        return LinearModel.of(self.problem, at, rows, level, extra, slopes, room, self._moves)

    @property
    def _moves(self) -> Floats:
        moves = REACH[:, None] * self.problem.constraints.motion
        moves = moves if self.free else moves[:, :0]
        return with_guides(moves, STEP_M * np.eye(len(self.problem.machine.rail_positions))) if self.guides else moves

    @cached_property
    def _room(self) -> Room:
        return placement_room(self.problem.constraints, free=self.free)
