"""plan: where to clamp the part, in which component to work, and how to tilt the tool."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pentapod.arrays import Floats, Ints
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import COMPONENTS, Component
from pentapod.machine.machine import Machine
from pentapod.planning.blame import refusal
from pentapod.planning.margins import Margins
from pentapod.planning.placed_path import PlacedPath
from pentapod.planning.placement import Placement
from pentapod.planning.problem import PlanningProblem
from pentapod.planning.sampling import Guess, best_tilted_margins, first_guesses
from pentapod.planning.task import Task
from pentapod.planning.tilt import FieldDomain, lean
from pentapod.progress import Progress, silent
from pentapod.refusal import Refusal
from pentapod.toolpath.toolpath import Toolpath

NEEDED_MARGIN = 0.02
"""A plan is accepted from this smallest margin on: what rounding corners between waypoints may cost."""

CALM_SHARE = 0.9
"""Share of the best smallest margin that is kept when the axis is made calm."""

REFINED = 6
"""How many first guesses are improved by IPOPT; the best of them are brought to the end, until one is good."""

_CELLS = 2
_POINTS, _ADDED, _ROUNDS = 48, 16, 6
_ROW_SLACK = 0.6


def plan(
    toolpath: Toolpath,
    machine: Machine,
    *,
    tilt: float = 0.0,
    placement: Placement | None = None,
    component: Component | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> PlacedPath | Refusal:
    """Choose placement, component and tool axes that keep the path well inside the machine's limits.

    tilt: half angle in radians of the cone around the nominal axis within which the tool may lean.
    placement, component: honoured where given; where not, all components and many placements are tried and
    the one with the largest smallest margin is kept. Deterministic for a seed. Returns a Refusal that names
    limits, waypoints and shortfalls where the part does not fit.
    """
    task = Task.of(toolpath, tilt)
    components = COMPONENTS if component is None else (component,)
    search = _Search(task, machine, progress)
    if placement is None:
        progress("placement", 0.0, "sampling")
        guesses = first_guesses(task, machine, components, seed)
        best = search.refine(guesses[:REFINED])
    else:
        fixed = [Guess(placement.transform, c, _strict(task, machine, c, placement.transform)) for c in components]
        best = search.fixed(max(fixed, key=lambda g: g.margin))
    margins, transform, coefficients, smallest = best
    if smallest < NEEDED_MARGIN:
        values, _ = best_tilted_margins(task, margins, transform)
        if (values.min(axis=1) >= NEEDED_MARGIN).all():  # each waypoint alone would do, not all with one smooth field
            values = margins(*task.machine_poses(transform, search.axes(coefficients)))
        return refusal(values, margins, NEEDED_MARGIN, fixed=placement is not None, tilt=tilt)
    if tilt > 0.0:
        progress("tool axis", 0.0, f"smallest margin {smallest:.3f}")
        coefficients = search.calm(margins, transform, coefficients, smallest)
    tips, axes = task.machine_poses(transform, search.axes(coefficients))
    chosen = placement if placement is not None else Placement(transform, "largest smallest margin")
    names = tuple(limit.name for limit in margins.limits)
    return PlacedPath(toolpath, chosen, margins.component, tips, axes, margins(tips, axes), names)


_Best = tuple[Margins, RigidTransform, Floats, float]


class _Search:
    """The refinement of guesses, with constraint generation: waypoints that come out worst are added until none is."""

    def __init__(self, task: Task, machine: Machine, progress: Progress) -> None:
        self.task, self.machine, self.progress = task, machine, progress
        self.domain = FieldDomain.around(task.pivots, task.nominal, _CELLS)
        self.basis = self.domain.basis(task.pivots) if task.tilt > 0.0 else None
        self.zero = np.zeros((self.domain.size, 2))

    def axes(self, coefficients: Floats) -> Floats:
        """Return the tool axes (N, 3), workpiece frame, of field coefficients."""
        return (
            self.task.nominal
            if self.basis is None
            else lean(self.task.nominal, self.basis @ coefficients @ self.domain.lean_plane)
        )

    def values(self, margins: Margins, transform: RigidTransform, coefficients: Floats) -> Floats:
        """Return the margins (N, M) at every waypoint."""
        return margins(*self.task.machine_poses(transform, self.axes(coefficients)))

    def fitted(self, margins: Margins, transform: RigidTransform) -> Floats:
        """Return coefficients of a smooth field near the tilts that are best for each representative by itself."""
        if self.basis is None:
            return self.zero
        rows = self.task.representatives(4 * _POINTS)
        _, leans = best_tilted_margins(self.task.at(rows), margins, transform)
        # Smoothness, lightly weighed, decides where the representatives do not.
        smooth = 0.3 * self.domain.roughness()
        matrix = np.vstack([self.basis[rows], smooth, 1e-3 * np.eye(self.domain.size)])
        wanted = np.vstack([leans @ self.domain.lean_plane.T, np.zeros((len(smooth) + self.domain.size, 2))])
        return np.asarray(np.linalg.lstsq(matrix, wanted, rcond=None)[0], dtype=np.float64)

    def refine(self, guesses: list[Guess]) -> _Best:
        """Return the best placement: every guess is improved once, the most promising one to the end."""
        attempts: list[_Attempt] = []
        for k, guess in enumerate(guesses):
            attempt = _Attempt(self, guess, free=True)
            attempt.improve()
            attempts.append(attempt)
            best = max(a.best[3] for a in attempts)
            self.progress("placement", (k + 1) / (len(guesses) + 2), f"component {guess.component}, margin {best:.3f}")
        attempts.sort(key=lambda a: -a.best[3])
        for attempt in attempts:
            if attempt.finished()[3] >= NEEDED_MARGIN:
                break
        return max((a.best for a in attempts), key=lambda b: b[3])

    def fixed(self, guess: Guess) -> _Best:
        """Return the best tilt field at a given placement."""
        margins = Margins.of(self.machine, guess.component)
        if self.task.tilt > 0.0:
            return _Attempt(self, guess, free=False).finished()
        values = self.values(margins, guess.transform, self.zero)
        return margins, guess.transform, self.zero, float(values.min())

    def calm(self, margins: Margins, transform: RigidTransform, start: Floats, smallest: float) -> Floats:
        """Return coefficients of the calmest field that keeps a share of the smallest margin at every waypoint."""
        keep = max(CALM_SHARE * smallest, NEEDED_MARGIN)
        few = self.few(margins, transform, 0.5 * _ROW_SLACK, free=False)
        coefficients = start
        for k in range(_ROUNDS):
            coefficients = few.problem.solve(few.rows, transform, coefficients, "calm", keep).coefficients
            values, steepness = self.values(margins, transform, coefficients), self.steepness(coefficients)
            self.progress("tool axis", (k + 1) / _ROUNDS, f"smallest margin {values.min():.3f}")
            if values.min() >= keep - 0.02 * abs(keep) - 1e-3 and steepness.max() <= 1.0:
                return coefficients
            few = few.with_worst(values, steepness, keep)
        return start  # it keeps every limit, and only leans more than it would have to

    def steepness(self, coefficients: Floats) -> Floats:
        """Return how much of the tilt cone each waypoint uses (N,): 1 on its edge."""
        if self.basis is None:
            return np.zeros(len(self.task.pivots))
        b = self.basis @ coefficients @ self.domain.lean_plane
        across = b - (b * self.task.nominal).sum(axis=1, keepdims=True) * self.task.nominal
        return np.asarray(np.linalg.norm(across, axis=1) / np.tan(self.task.tilt), dtype=np.float64)

    def within_cone(self, coefficients: Floats) -> Floats:
        """Return coefficients scaled down until every waypoint keeps the cone; a lean is linear in them."""
        return coefficients / max(1.0, float(self.steepness(coefficients).max()))

    def few(self, margins: Margins, transform: RigidTransform, slack: float, *, free: bool) -> _Few:
        """Return what to begin with: waypoints spread over the part, and the kinds of margin near the worst."""
        rows = self.task.representatives(4 * _POINTS)
        few = self.task.at(rows)
        values = margins(*few.machine_poses(transform, few.nominal)).min(axis=0)
        kinds = np.flatnonzero(values < values.min() + slack)
        return _Few(self, margins, self.task.representatives(_POINTS), kinds, free)


@dataclass(frozen=True, eq=False)
class _Few:
    """The waypoints and the kinds of margin that a solver considers; those left out that come out worst are added."""

    search: _Search
    margins: Margins
    rows: Ints
    kinds: Ints
    free: bool

    @cached_property
    def problem(self) -> PlanningProblem:
        """The problem with these kinds of margin, built once."""
        return PlanningProblem(self.search.task, self.margins, self.search.domain, self.kinds.tolist(), free=self.free)

    def with_worst(self, values: Floats, steepness: Floats, threshold: float) -> _Few:
        """Return also the waypoints, and the kinds of margin, whose values (N, M) fall below a threshold."""
        kinds = np.union1d(self.kinds, np.flatnonzero(values.min(axis=0) < threshold))
        # A lean beyond the cone counts like a margin that much too small.
        worst = np.minimum(values.min(axis=1), threshold + 1.0 - np.maximum(steepness, 1.0))
        rows = np.union1d(self.rows, self._spread(worst, threshold))
        if len(kinds) == len(self.kinds):
            same = replace(self, rows=rows)
            same.__dict__["problem"] = self.problem
            return same
        return replace(self, rows=rows, kinds=kinds)

    def _spread(self, worst: Floats, threshold: float) -> Ints:
        """Return the worst waypoints below a threshold that lie apart from each other."""
        pivots = self.search.task.pivots
        order = np.argsort(worst, kind="stable")[:2000]
        added: list[int] = []
        apart = 0.04 * float(np.ptp(pivots, axis=0).max())
        for k in order[worst[order] < threshold]:
            if not added or np.linalg.norm(pivots[added] - pivots[k], axis=1).min() > apart:
                added.append(int(k))
            if len(added) == _ADDED:
                break
        return np.array(added, dtype=np.intp)


class _Attempt:
    """One guess on its way to the largest smallest margin, with the waypoints and margins it has gathered."""

    def __init__(self, search: _Search, guess: Guess, *, free: bool) -> None:
        self.search, self.margins = search, Margins.of(search.machine, guess.component)
        start = search.within_cone(search.fitted(self.margins, guess.transform))
        smallest = float(search.values(self.margins, guess.transform, start).min())
        self.best: _Best = (self.margins, guess.transform, start, smallest)
        self.few = search.few(self.margins, guess.transform, _ROW_SLACK, free=free)

    def improve(self) -> bool:
        """Solve once; return whether something that was left out came out worse than what was considered."""
        _, transform, coefficients, smallest = self.best
        few = self.few
        solution = few.problem.solve(few.rows, transform, coefficients, "margin", smallest)
        found = self.search.within_cone(solution.coefficients)
        values = self.search.values(self.margins, solution.placement, found)
        if values.min() > smallest:
            self.best = (self.margins, solution.placement, found, float(values.min()))
        considered = max(float(values[np.ix_(few.rows, few.kinds)].min()), smallest)
        self.few = few.with_worst(values, self.search.steepness(solution.coefficients), considered)
        return len(self.few.rows) > len(few.rows) or len(self.few.kinds) > len(few.kinds)

    def finished(self) -> _Best:
        """Improve until nothing left out is worse than what is considered, and return the best."""
        for _ in range(_ROUNDS):
            if not self.improve():
                break
        return self.best


def _strict(task: Task, machine: Machine, component: Component, transform: RigidTransform) -> float:
    return float(Margins.of(machine, component)(*task.machine_poses(transform, task.nominal)).min())
