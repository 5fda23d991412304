"""The default placement solver: sequential quadratic programming with a trust region, for the max-min problem.

Each program holds only the smallest margins, at the waypoints where they are smallest (Fletcher, Practical Methods of
Optimization, ch. 14: minimax). Every step is judged by the margins themselves, so a poor model costs only a step.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.progress import Progress, silent
from pentapod.geometry.rigid import RigidTransform
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.curvature import Curvature
from pentapod.planning.placement.rail_positions import STEP_M, at_rail_positions, with_guides, with_travel
from pentapod.planning.problem.formulation import Room, StepSlopes, placement_room, step_slopes, stepped
from pentapod.planning.problem.linear_model import REACH, LinearModel, valleys
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.problem.weights import NEEDED_MARGIN
from pentapod.planning.tool_axis.smoothing import smoothed

_NO_ROWS: Ints = np.zeros(0, dtype=np.intp)


@dataclass(frozen=True)
class SequentialOptions:
    """Options of the trust-region method.

    waypoints: used in every step, evenly spaced, beside those where the margins are smallest, up to `lowest` for each
    kind; all, where there are no more than twice as many. All are checked when the steps have ended. steps, rounds:
    maximum of steps, and of checks at all waypoints. recent, least_gain: steps also end where so many of them have
    raised a margin that fits by less than this share. tolerance: decrease of the smallest margin at all waypoints that
    calls for another round. least: smaller predicted increases, and smaller trust regions, end the steps. rough: the
    predicted increase where candidates are compared, and `astray` the tolerance then. hope: predicted increases below
    the margin to beat at which steps end then. known_m, known_rad: from another candidate, as near steps end that do
    not lead to more. radius: of the first trust region. accepted, good, very_good: ratios of actual to predicted
    increase from which a step is taken, and the radius is kept, and doubled; else it shrinks by the factor shrink, from
    the length of the step where that is less.
    """

    waypoints: int = 400
    lowest: int = 24
    steps: int = 60
    recent: int = 10
    least_gain: float = 3e-3
    rounds: int = 10
    tolerance: float = 1e-4
    least: float = 1e-5
    rough: float = 5e-4
    astray: float = 2e-3
    hope: float = 12.0
    known_m: float = 5e-3
    known_rad: float = float(np.radians(5.0))
    radius: float = 0.5
    accepted: float = 0.05
    good: float = 0.25
    very_good: float = 0.6
    shrink: float = 0.4


@dataclass(eq=False)
class SequentialSolver:
    """Improves candidates of one problem. free, guides: whether placement and rail positions are free.

    rows: waypoints used in every step; evenly spaced ones by default.
    """

    problem: PlacementProblem
    free: bool
    guides: bool = False
    options: SequentialOptions = SequentialOptions()
    rows: Ints | None = None

    def raise_margin(
        self, start: Candidate, enough: float = np.inf, others: Sequence[Candidate] | None = None
    ) -> Candidate:
        """Return a candidate whose smallest margin is largest near `start`, or with `enough`; never a worse one.

        others: candidates with which it is compared. Steps then end where they lead to less, or to one of them, and
        near the optimum.
        """
        best, rows = start, self._waypoints(start)
        tolerance = self.options.tolerance if others is None else self.options.astray
        beat = -np.inf if others is None else max((other.smallest for other in others), default=-np.inf)
        found = best
        for _ in range(self.options.rounds):
            found = self._optimised(found, rows, enough + self.options.tolerance, others)
            values = self.problem.values(found.margins, found.transform, found.coefficients)
            smallest = float(values.min())
            if smallest > best.smallest:
                best = Candidate(found.margins, found.transform, found.coefficients, smallest)
            if smallest >= found.smallest - tolerance or found.smallest < beat:
                break
            rows = np.union1d(rows, _smallest(values, self.options.lowest))
        return best

    def smooth(self, start: Candidate, keep: float, progress: Progress = silent) -> Floats | None:
        """Return coefficients (K, 2) of the smoothest spline at the placement of `start` that keeps `keep`."""
        return smoothed(self.problem, start, keep, progress=progress)

    def _waypoints(self, start: Candidate) -> Ints:
        """Return the waypoints of the first round."""
        if self.rows is not None:
            return self.rows
        count, most = len(self.problem.samples.tilt_centres), self.options.waypoints
        if count <= 2 * most:
            return np.arange(count)
        values = self.problem.values(start.margins, start.transform, start.coefficients)
        spread = np.linspace(0, count - 1, most).astype(np.intp)
        return np.union1d(spread, _smallest(values, self.options.lowest))

    def _optimised(self, start: Candidate, rows: Ints, enough: float, others: Sequence[Candidate] | None) -> Candidate:
        """Return the result of the trust-region method, with its smallest margin over `rows`."""
        problem, options, radius, extra, leaning = self.problem, self.options, self.options.radius, _NO_ROWS, _NO_ROWS
        least = options.least if others is None else options.rough
        here = problem.values(start.margins, start.transform, start.coefficients, rows)
        best = Candidate(start.margins, start.transform, start.coefficients, float(here.min()))
        slopes = step_slopes(problem, start.margins, guides=self.guides)
        curvature, known = Curvature(problem, start.margins, self.guides), None
        model = self.model(best, rows, best.smallest, slopes=slopes, values=here)
        reached = deque[float](maxlen=options.recent)
        for _ in range(options.steps):
            if best.smallest >= enough or (len(reached) == options.recent and self._stalls(reached[0], best.smallest)):
                break
            reached.append(best.smallest)
            step = curvature.best_step(model, best, radius, known)
            known, predicted = step.multipliers, step.predicted
            if predicted < least or self._leads_to_no_more(best, predicted, others or ()):
                break
            coefficients, values, gain = problem.within_cone(best.coefficients + step.change), np.zeros((0, 1)), -np.inf
            moved = self._moved(best, step.move)
            if moved is not None:
                values = problem.values(*moved, coefficients, rows)
                gain = float(values.min()) - best.smallest
            if gain > options.very_good * predicted:
                radius *= 2.0
            elif gain <= options.good * predicted:
                radius = options.shrink * min(radius, step.length)
            if moved is not None and gain > options.accepted * predicted:
                best, here = Candidate(*moved, coefficients, float(values.min())), values
            elif radius < least:
                break
            elif moved is not None:  # the worst margins may not have been in the model
                extra = np.union1d(extra, valleys(values))
                leaning = np.union1d(leaning, valleys(-problem.steepness(best.coefficients + step.change)[:, None]))
            model = self.model(best, rows, best.smallest, (extra, leaning), slopes, here)
        return best

    def _stalls(self, before: float, smallest: float) -> bool:
        """Return whether a margin that fits has hardly grown since it was `before`."""
        return smallest >= NEEDED_MARGIN and smallest - before < self.options.least_gain * smallest

    def _leads_to_no_more(self, at: Candidate, predicted: float, others: Sequence[Candidate]) -> bool:
        """Return whether steps from here are expected to end below another candidate, or at it."""
        return any(
            at.smallest + self.options.hope * predicted < other.smallest
            or (at.smallest + predicted < other.smallest and self._is_near(at, other))
            for other in others
        )

    def _is_near(self, at: Candidate, other: Candidate) -> bool:
        """Return whether two candidates are placements in one branch that hardly differ."""
        centre, options = self.problem.samples.tilt_centres.mean(axis=0), self.options
        apart = float(np.linalg.norm(at.transform.apply(centre) - other.transform.apply(centre)))
        cosine = 0.5 * (float(np.trace(at.transform.rotation.T @ other.transform.rotation)) - 1.0)
        alike = at.margins.scene.branch == other.margins.scene.branch
        return self.free and alike and apart < options.known_m and cosine > np.cos(options.known_rad)

    def _moved(self, at: Candidate, step: Floats) -> tuple[Margins, RigidTransform] | None:
        """Return margins and placement after a step; None where the guides cannot reach their positions."""
        transform, margins = at.transform, at.margins
        if self.free:
            transform = self.problem.constraints.nearest_to(stepped(transform, step[:6]))
        if self.guides:
            there = at_rail_positions(margins, margins.scene.machine.rail_positions + step[6:])
            return None if there is None else (there, transform)
        return margins, transform

    def model(
        self,
        at: Candidate,
        rows: Ints,
        level: float,
        extra: tuple[Ints, Ints] = (_NO_ROWS, _NO_ROWS),
        slopes: StepSlopes | None = None,
        values: Floats | None = None,
    ) -> LinearModel:
        """Return the linear model around a candidate of what comes near a margin of `level` among `rows`.

        extra: what enters in any case: margins at indices into rows, and leans at waypoints. slopes: of the margins;
        those of the candidate by default. values (n, M): the candidate's margins at `rows`, where they are known.
        """
        slopes = step_slopes(self.problem, at.margins) if slopes is None else slopes
        room = self._room(at.transform)
        if self.guides:
            room = with_travel(at.margins.scene.machine, room)
        return LinearModel.of(self.problem, at, rows, level, extra, slopes, room, self._moves, values)

    @property
    def _moves(self) -> Floats:
        moves = REACH[:, None] * self.problem.constraints.motion
        moves = moves if self.free else moves[:, :0]
        return with_guides(moves, STEP_M * np.eye(len(self.problem.machine.rail_positions))) if self.guides else moves

    @cached_property
    def _room(self) -> Room:
        return placement_room(self.problem.constraints, free=self.free)


def _smallest(values: Floats, count: int) -> Ints:
    """Return the waypoints of the smallest local minima of margins (N, M), and where these are smallest of all."""
    return np.union1d(valleys(values, count), np.argsort(values.min(axis=1), kind="stable")[: 4 * count])
