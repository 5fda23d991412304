"""Estimate: roughly the best smallest margin for a few points of a path; much cheaper than a plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from pentapod.base.refusal import Shortfall
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.robot import Branch
from pentapod.machine.clearance.collision_world import NOTHING
from pentapod.numerics.threads import on_one_thread
from pentapod.planning.diagnosis import diagnose
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.common_axes import OPTIONS as COMMON_AXES
from pentapod.planning.placement.common_axes import directions
from pentapod.planning.placement.sampling import SamplingOptions, best_tilted_margins, first_candidate, first_guesses
from pentapod.planning.placement.search import SOLVERS
from pentapod.planning.problem.common_axis import CommonAxis
from pentapod.planning.problem.constraints import PlacementConstraints
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.weights import NEEDED_MARGIN


@dataclass(frozen=True)
class EstimateOptions:
    """How an estimate is made.

    tries, ranked: random placements, and how many of them are judged with a tilt field, for each branch. starts: of
    the local solver, for all kinds of axes together. hopeless: margin of a first guess below which nothing is improved.
    """

    tries: int = 900
    ranked: int = 6
    starts: int = 2
    hopeless: float = -1.0


@dataclass(frozen=True, eq=False)
class Estimate:
    """Roughly the best smallest margin: that of `candidate`, for one of several kinds of axes, `samples`."""

    samples: ToolpathSamples
    candidate: Candidate

    @property
    def margin(self) -> float:
        """The smallest margin of the candidate."""
        return self.candidate.smallest

    @property
    def shortfalls(self) -> tuple[Shortfall, ...]:
        """The limits that the candidate exceeds, the worst first; waypoints count the samples."""
        margins = self.candidate.margins
        return diagnose(best_tilted_margins(self.samples, margins, self.candidate.transform)[0], margins, NEEDED_MARGIN)


Start = tuple[float, PlacementProblem, Margins, RigidTransform]


@dataclass(frozen=True, eq=False)
class Estimator:
    """Estimates for one machine. bare, world: problems without and with its obstacles; their paths are replaced.

    What a solver derives from margins is kept with them: estimates of one estimator share it.
    """

    bare: PlacementProblem
    world: PlacementProblem | None
    options: EstimateOptions = EstimateOptions()

    @classmethod
    def of(cls, problem: PlacementProblem) -> Estimator:
        """Return the estimator for the machine, obstacles and weights of a problem, in any of its branches."""
        if problem.margins[0].scene.collision_world is NOTHING:
            return cls(problem, None)
        return cls(problem.without_collision_world(), problem)

    @on_one_thread
    def best(
        self,
        kinds: Sequence[ToolpathSamples],
        constraints: PlacementConstraints,
        branch: Branch | None,
        enough: float,
        near: Estimate | None = None,
    ) -> Estimate:
        """Return the best of several kinds of axes, as far as a short search finds it; `enough` ends the search.

        near: an estimate of a similar task to begin with. Obstacles are looked at last: what does not fit without them
        does not fit with them.
        """
        task = _within(self.bare, constraints, branch)
        starts = [start for samples in kinds for start in self._starts(task.along(samples), near)]
        best: Estimate | None = None
        for margin, own, margins, transform in sorted(starts, key=lambda start: -start[0])[: self.options.starts]:
            if best is not None and (best.margin >= enough or margin < self.options.hopeless):
                break
            found = _improved(own, margins, transform, enough)
            best = found if best is None or found.margin > best.margin else best
        if best is None:  # not reached: there are branches, and guesses in each
            raise RuntimeError("nothing was estimated")
        if self.world is None or best.margin < NEEDED_MARGIN:
            return best
        task = _within(self.world, constraints, best.candidate.margins.scene.branch)
        return _improved(task.along(best.samples), task.margins[0], best.candidate.transform, enough)

    def _starts(self, problem: PlacementProblem, near: Estimate | None) -> list[Start]:
        """Return places to start from, each with its margin, problem and branch."""
        if near is not None:
            branch = near.candidate.margins.scene.branch
            margins = next(margins for margins in problem.margins if margins.scene.branch == branch)
            places = [(margins, problem.constraints.nearest_to(near.candidate.transform))]
        elif problem.constraints.moves:
            sampling = SamplingOptions(tries=self.options.tries, ranked=self.options.ranked)
            guesses = islice(first_guesses(problem, 0, sampling), self.options.starts)
            return [(guess.margin, problem, guess.margins, guess.transform) for guess in guesses]
        else:
            places = [(margins, pose) for pose in problem.constraints.poses for margins in problem.margins]
        judged = (float(best_tilted_margins(problem.samples, margins, pose)[0].min()) for margins, pose in places)
        return [(margin, problem, *place) for margin, place in zip(judged, places, strict=True)]


def leaning(own: ToolpathSamples, limit: float, constraints: PlacementConstraints) -> list[ToolpathSamples]:
    """Return the samples of a path with its own axes, and leaning from them towards several common directions.

    limit: largest angle from the own axes, radians.
    """
    kinds = [replace(own, tilt=min(limit, COMMON_AXES.tilt))]
    if limit > COMMON_AXES.tilt:
        kinds += [
            kinds[0].towards(CommonAxis(direction, cone, limit))
            for direction in directions(own.nominal, constraints)
            for cone in np.radians(COMMON_AXES.cones_deg).tolist()
        ]
    return kinds


def _within(problem: PlacementProblem, constraints: PlacementConstraints, branch: Branch | None) -> PlacementProblem:
    """Return a problem with other allowed placements, and in one branch, if one is given."""
    kept = tuple(m for m in problem.margins if branch is None or m.scene.branch == branch)
    return replace(problem, constraints=constraints, margins=kept)


def _improved(problem: PlacementProblem, margins: Margins, transform: RigidTransform, enough: float) -> Estimate:
    """Return what the local solver makes of a place."""
    solver = SOLVERS["sequential"](problem, problem.constraints.moves)
    return Estimate(problem.samples, solver.raise_margin(first_candidate(problem, margins, transform), enough))
