"""Secondary objective: small leg forces or a short machining time, by sequential linear programming.

The smallest margin is kept above a bound. The programs hold the linear model of the margins, and derivatives of the
objective by central differences at each waypoint: by the placement's motion and the waypoint's lean; those by the tilt
field follow from its basis.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.forces import tip_force_amplification
from pentapod.planning.placement.sequential import SequentialSolver
from pentapod.planning.problem.formulation import stepped
from pentapod.planning.problem.linear_model import LinearModel, by_field, valleys
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.problem.tilt_field import lean
from pentapod.toolpath.toolpath import Toolpath

SecondaryObjective = Literal["force", "time"]

Poses = tuple[Floats, Floats]
"""Tips and tool axes (n, 3), machine frame."""

_NO_ROWS: Ints = np.zeros(0, dtype=np.intp)


@dataclass(frozen=True)
class ObjectiveOptions:
    """Options of the sequential linear programming.

    steps: maximum. radius, least_radius: the first and the smallest trust region, in units of the placement step.
    decrease: relative decrease of the objective below which the iteration stops. slack: violation of the bound on the
    margin that is accepted. accepted, very_good: ratios of actual to predicted decrease from which a step is taken, and
    the radius is doubled; shrink: its factor after a rejected step. worst, spread: waypoints whose forces enter a
    program: the worst ones, and representatives of the path. difference: step of the central differences.
    """

    steps: int = 40
    radius: float = 0.3
    least_radius: float = 1e-3
    decrease: float = 1e-3
    slack: float = 1e-5
    accepted: float = 0.1
    very_good: float = 0.6
    shrink: float = 0.4
    worst: int = 48
    spread: int = 96
    difference: float = 1e-5


OPTIONS = ObjectiveOptions()


class Objective(Protocol):
    """An objective: the maximum of some pieces, each a function of quantities at the waypoints."""

    def value(self, at: Candidate) -> float:
        """Return the objective over the whole path."""
        ...

    def pieces(self, at: Candidate, model: LinearModel) -> tuple[Floats, Floats]:
        """Return pieces (K,), whose maximum is the objective, and derivatives (K, n) by the model's unknowns."""
        ...


@dataclass(frozen=True, eq=False)
class LeastForce:
    """The largest leg forces that one newton at the tip causes anywhere on the path, N/N."""

    problem: PlacementProblem

    def value(self, at: Candidate) -> float:
        """Return the worst amplification over all waypoints."""
        return float(self._at_all(at).max())

    def pieces(self, at: Candidate, model: LinearModel) -> tuple[Floats, Floats]:
        """Return the amplification at the worst waypoints, and at representatives of the path."""
        problem, values = self.problem, self._at_all(at)
        worst = np.argsort(-values, kind="stable")[: OPTIONS.worst]
        rows = np.union1d(worst, problem.samples.representatives(OPTIONS.spread))
        by_motion, by_lean = _partials(
            problem, at, rows, model.moves, lambda poses: self._amplification(poses)[:, None]
        )
        by_coefficients = by_field(problem.basis[rows], by_lean[:, 0]) * problem.cone
        return values[rows], np.hstack([by_motion[:, 0], by_coefficients])

    def _at_all(self, at: Candidate) -> Floats:
        return self._amplification(self.problem.samples.machine_poses(at.transform, self.problem.axes(at.coefficients)))

    def _amplification(self, poses: Poses) -> Floats:
        length, (tips, axes) = self.problem.machine.tool_length, poses
        return tip_force_amplification(self.problem.machine.robot, tips + length * axes, -axes, length)


@dataclass(frozen=True, eq=False)
class LeastTime:
    """A lower bound of the machining time, seconds: ∫ max(1/feed, |l_i'|/v_i over the legs) ds.

    feeds (N − 1,): m/s, at most the machine's rapid rate.
    """

    problem: PlacementProblem
    feeds: Floats

    def value(self, at: Candidate) -> float:
        """Return the bound."""
        return float(self._times(at)[0].sum())

    def pieces(self, at: Candidate, model: LinearModel) -> tuple[Floats, Floats]:
        """Return the bound as one piece: a sum of so many maxima that it is almost smooth."""
        problem, robot, length = self.problem, self.problem.machine.robot, self.problem.machine.tool_length
        times, weights = self._times(at)
        rows = np.flatnonzero((weights != 0.0).any(axis=1))

        def legs_and_tips(poses: Poses) -> Floats:
            tips, axes = poses
            return np.hstack([robot.leg_lengths(tips + length * axes, -axes), tips])

        by_motion, by_lean = _partials(problem, at, rows, model.moves, legs_and_tips)
        by_motion = np.einsum("ni,nik->nk", weights[rows], by_motion)
        by_lean = np.einsum("ni,nik->nk", weights[rows], by_lean)
        slope = np.concatenate([by_motion.sum(axis=0), (problem.basis[rows].T @ by_lean * problem.cone).ravel()])
        return np.array([times.sum()]), slope[None]

    def _times(self, at: Candidate) -> tuple[Floats, Floats]:
        """Return the least time (N − 1,) of each interval, and the slope of their sum by legs and tip (N, n + 3)."""
        problem, machine = self.problem, self.problem.machine
        tips, axes = problem.samples.machine_poses(at.transform, problem.axes(at.coefficients))
        steps = np.diff(machine.robot.leg_lengths(tips + machine.tool_length * axes, -axes), axis=0)
        by_leg = np.abs(steps) / machine.legs.max_velocity
        leg = by_leg.argmax(axis=1)
        index = np.arange(len(leg))
        chords = np.diff(tips, axis=0)
        way = np.linalg.norm(chords, axis=1)
        by_feed, slowest = way / self.feeds, by_leg[index, leg]
        held = slowest > by_feed
        n_legs = machine.robot.n_legs
        by_step = np.zeros((len(chords), n_legs + 3))
        by_step[index, leg] = np.where(held, np.sign(steps[index, leg]) / machine.legs.max_velocity[leg], 0.0)
        by_step[:, n_legs:] = np.where(held[:, None], 0.0, chords / (np.maximum(way, 1e-12) * self.feeds)[:, None])
        weights = np.zeros((len(tips), n_legs + 3))
        weights[:-1] -= by_step
        weights[1:] += by_step
        return np.maximum(slowest, by_feed), weights


def objective_of(name: SecondaryObjective, problem: PlacementProblem, toolpath: Toolpath, rows: Ints) -> Objective:
    """Return the objective of this name for the problem of the waypoints `rows` (n,) of a toolpath."""
    if name == "force":
        return LeastForce(problem)
    feeds = np.array([segment.feed for segment in toolpath.segments])[toolpath.segment_of_interval[rows[:-1]]]
    return LeastTime(problem, np.minimum(feeds, problem.machine.rapid_velocity))


def improved(solver: SequentialSolver, start: Candidate, objective: Objective, keep: float) -> Candidate:
    """Return a candidate near `start` with a smaller objective, and a smallest margin of at least `keep`."""
    problem, rows = solver.problem, np.arange(len(solver.problem.samples.tilt_centres))
    best, radius, extra = start, OPTIONS.radius, _NO_ROWS
    value = objective.value(best)
    model = solver.model(best, rows, keep)
    pieces = objective.pieces(best, model)
    for _ in range(OPTIONS.steps):
        step = _lowest(model, pieces, keep, radius)
        trial, predicted = None, 0.0
        if step is not None:
            motion, change, predicted = step
            predicted += value - float(pieces[0].max())
            transform = stepped(best.transform, motion) if model.moves.size else best.transform
            transform = problem.constraints.nearest_to(transform)
            trial = problem.candidate(best.margins, transform, problem.within_cone(best.coefficients + change))
        gain = value - objective.value(trial) if trial is not None else 0.0
        enough = gain > OPTIONS.accepted * predicted and gain > 0.0
        if trial is not None and trial.smallest >= keep - OPTIONS.slack and enough:
            done = gain < OPTIONS.decrease * value
            best, value, extra = trial, value - gain, _NO_ROWS
            radius *= 2.0 if gain > OPTIONS.very_good * predicted else 1.0
            if done:
                break
            model = solver.model(best, rows, keep)
            pieces = objective.pieces(best, model)
        else:
            radius *= OPTIONS.shrink
            if radius < OPTIONS.least_radius:
                break
            if trial is not None and trial.smallest < keep:  # the worst margins may not have been in the model
                values = problem.values(trial.margins, trial.transform, trial.coefficients)
                extra = np.union1d(extra, valleys(values))
                model = solver.model(best, rows, keep, (extra, _NO_ROWS))
    return best


def _lowest(
    model: LinearModel, pieces: tuple[Floats, Floats], keep: float, radius: float
) -> tuple[Floats, Floats, float] | None:
    """Return step (6,) and change of coefficients (size, 2) that minimise the largest piece, and its decrease."""
    from scipy.optimize import linprog  # noqa: PLC0415  heavy: only when planning

    count, now = model.matrix.shape[1], float(pieces[0].max())
    unit = max(abs(now), 1e-12)
    kept = np.vstack([-model.matrix, model.steep_matrix, -model.room_matrix])
    answer: Any = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.vstack([
            np.column_stack([pieces[1] / unit, np.full(len(pieces[0]), -1.0)]),
            np.column_stack([kept, np.zeros(len(kept))]),
        ]),
        b_ub=np.concatenate([
            -pieces[0] / unit,
            model.values - keep,
            np.maximum(np.append(1.0 - model.steepness, model.room), 0.0),
        ]),
        bounds=[(-radius, radius)] * count + [(None, None)],
        method="highs-ds",
    )  # fmt: skip
    if answer.status != 0:
        return None
    x = np.asarray(answer.x, dtype=np.float64)
    return *model.step_of(x[:-1]), now - float(x[-1]) * unit


def _partials(
    problem: PlacementProblem, at: Candidate, rows: Ints, moves: Floats, quantity: Callable[[Poses], Floats]
) -> tuple[Floats, Floats]:
    """Return central differences of quantities (n, I) by the moves (6, k), (n, I, k), and by the lean, (n, I, 2)."""
    still = np.zeros(2)

    def at_offset(step: Floats, tilt: Floats) -> Floats:
        b = (problem.basis[rows] @ at.coefficients + tilt) @ problem.domain.lean_plane
        transform: RigidTransform = stepped(at.transform, step)
        return quantity(problem.samples.machine_poses(transform, lean(problem.samples.nominal[rows], b), rows))

    h = OPTIONS.difference
    by_motion = [at_offset(step, still) - at_offset(-step, still) for step in (h * moves).T]
    by_lean = [at_offset(np.zeros(6), h * u) - at_offset(np.zeros(6), -h * u) for u in np.eye(2)]
    first = np.stack(by_motion, axis=-1) if by_motion else np.zeros((*by_lean[0].shape, 0))
    return first / (2.0 * h), np.stack(by_lean, axis=-1) / (2.0 * h)
