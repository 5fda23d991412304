"""guided: where the guides of a reconfigurable machine are to stand, chosen together with the placement.

The guides' slides are five more unknowns of the same problem. Which part of their travel is worth a search is told by
first guesses at a spread of slides; from the best placement found, placement, slides and tilt field climb together, by
sequential linear programming on derivatives of the one formulation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pentapod.arrays import Floats, Ints
from pentapod.errors import MachineError
from pentapod.kinematics.component import COMPONENTS, Component
from pentapod.machine.machine import Machine
from pentapod.machine.surroundings import NOTHING, Surroundings
from pentapod.planning.formulation import guide_function, room_function, stepped
from pentapod.planning.linear_model import REACH, by_field, valleys
from pentapod.planning.margins import Margins
from pentapod.planning.sampling import best_tilted_margins, first_guesses
from pentapod.planning.search import SOLVERS, Search, SolverName, search
from pentapod.planning.setting import Candidate, Setting
from pentapod.planning.vectorised import Vectorised
from pentapod.planning.weights import NEEDED_MARGIN
from pentapod.progress import Progress, silent

SPREAD = 16
"""So many positions of the guides, all over their travel, are looked at beside where they stand."""

_SAMPLES = 1_500
_ROUNDS, _STEPS = 6, 40
_GAIN, _LEAST = 1e-3, 1e-5
_NEAR, _CONSIDERED = 0.4, 1_000
_STEEPEST, _STEEP = 60, 0.5
_TANGENTS = np.radians([-30.0, -12.0, 0.0, 12.0, 30.0])
_SLIDE_M = 0.1  # the unit of a slide's step
_DIGITS = 6  # guides are set to the micrometre, so that people can read them and files hold them


def guided(
    setting: Setting,
    component: Component | None = None,
    surroundings: Surroundings = NOTHING,
    *,
    seed: int = 0,
    solver: SolverName = "sequential",
    progress: Progress = silent,
) -> tuple[Setting, Search]:
    """Return the setting with the machine's guides where they are to stand, and what the search there found.

    Never worse than with the guides as they stand. Only slides are taken that the guides reach by moving evenly without
    an architectural singularity on the way. KeyboardInterrupt as in `search`.
    """
    home = setting, search(setting, component, surroundings, seed=seed, solver=solver, progress=progress)
    if home[1].interrupted:
        return home
    best = home
    try:
        other = _promising(setting, component, surroundings, seed, progress)
        if other is not setting:
            found = search(other, component, surroundings, seed=seed, solver=solver, progress=progress)
            best = max(home, (other, found), key=lambda each: each[1].best.smallest)
        for k in range(_ROUNDS):
            there, candidate = best[0], best[1].best
            progress("placement", k / _ROUNDS, f"guides; best margin so far {candidate.smallest:.3f}")
            there, moved = _Climb(there, surroundings).climbed(candidate)
            if moved.smallest < candidate.smallest + _GAIN:
                break
            moved = SOLVERS[solver](there, there.freedom.moves).raise_margin(moved)
            best = there, replace(best[1], best=moved)
    except KeyboardInterrupt:
        if best[1].best.smallest < NEEDED_MARGIN:
            raise
        best = best[0], replace(best[1], interrupted=True)
    return best


def at_slides(setting: Setting, slides: Floats) -> Setting | None:
    """Return the setting with its machine's guides at slides (5,); None where they cannot stand or get there."""
    guides = setting.machine.guides
    if guides is None or not guides.stays_regular(np.zeros(5), slides):
        return None
    try:
        return replace(setting, machine=setting.machine.at(slides))
    except MachineError:
        return None


def _promising(
    setting: Setting, component: Component | None, surroundings: Surroundings, seed: int, progress: Progress
) -> Setting:
    """Return the setting whose guides let first guesses of the placement come out best."""
    components = COMPONENTS if component is None else (component,)
    scores: list[tuple[float, Setting]] = []
    for k, slides in enumerate([setting.machine.slides, *_spread(setting.machine, seed)]):
        progress("placement", k / SPREAD, "guides")
        there = at_slides(setting, slides)
        if there is not None:
            scores.append((_promise(there, components, surroundings, seed), there))
    return max(scores, key=lambda pair: pair[0])[1] if scores else setting


def _promise(setting: Setting, components: tuple[Component, ...], surroundings: Surroundings, seed: int) -> float:
    task, machine, freedom = setting.task, setting.machine, setting.freedom
    if freedom.moves:
        guesses = first_guesses(
            task, machine, components, seed, samples=_SAMPLES, freedom=freedom, surroundings=surroundings
        )
        return max(guess.margin for guess in guesses)
    few = task.at(task.representatives(48))
    poses = [(Margins.of(machine, c, surroundings), pose) for c in components for pose in freedom.poses]
    return max(float(best_tilted_margins(few, margins, pose)[0].min()) for margins, pose in poses)


def _spread(machine: Machine, seed: int) -> Floats:
    """Return slides (SPREAD, 5) all over the travel: a Latin hypercube."""
    guides, rng = machine.guides, np.random.default_rng(seed)
    if guides is None:
        return np.zeros((0, 5))
    share = (np.stack([rng.permutation(SPREAD) for _ in range(5)], axis=1) + 0.5) / SPREAD
    least, greatest = guides.travel.T
    return np.round(least + share * (greatest - least), _DIGITS)


Slopes = Callable[[Setting, Candidate, Ints], Floats]
Room = Callable[..., tuple[Floats, Floats]]


@dataclass(frozen=True, eq=False)
class _Step:
    """Of the placement (6,), of the guides (5,), of the tilt field's coefficients; and how much margin they promise."""

    placement: Floats
    slides: Floats
    coefficients: Floats
    promise: float


@dataclass(eq=False)
class _Climb:
    """Placement, slides and tilt field climb together from a candidate."""

    setting: Setting
    surroundings: Surroundings

    def climbed(self, start: Candidate) -> tuple[Setting, Candidate]:
        """Return the setting and the candidate that a trust-region method reaches; never a worse one."""
        setting, best, reach = self.setting, start, 0.5
        slopes, free = self._slopes(start.margins), setting.freedom.moves
        room = room_function(setting.freedom) if setting.freedom.is_bounded and free else None
        for _ in range(_STEPS):
            step = self._best_step(setting, best, slopes, room, reach)
            if step.promise < _LEAST or reach < _LEAST:
                break
            slides = np.clip(np.round(setting.machine.slides + step.slides, _DIGITS), *self._travel)
            there, gain = at_slides(self.setting, slides), -np.inf
            if there is not None:
                turned = setting.freedom.nearest_to(stepped(best.transform, step.placement)) if free else best.transform
                coefficients = setting.within_cone(best.coefficients + step.coefficients)
                margins = Margins.of(there.machine, best.margins.component, self.surroundings)
                found = there.candidate(margins, turned, coefficients)
                gain = found.smallest - best.smallest
                if gain > 0.05 * step.promise:
                    setting, best = there, found
            reach *= 2.0 if gain > 0.6 * step.promise else 1.0 if gain > 0.25 * step.promise else 0.4
        return setting, best

    @property
    def _travel(self) -> Floats:
        guides = self.setting.machine.guides
        return np.zeros((2, 5)) if guides is None else guides.travel.T

    def _slopes(self, margins: Margins) -> Slopes:
        """Return what gives the derivatives (n, M, 13) of the margins by step, slides and lean at waypoints."""
        start, function = self.setting, Vectorised(guide_function(self.setting, margins))

        def slopes(setting: Setting, at: Candidate, rows: Ints) -> Floats:
            task, slid = setting.task, setting.machine.slides - start.machine.slides
            leans = (setting.basis[rows] @ at.coefficients).T if task.tilt > 0.0 else np.zeros((2, 1))
            touching = setting.contacts(at.margins, at.transform, setting.leans(at.coefficients, rows), rows)
            _, found = function(
                slid[:, None], np.zeros((6, 1)), leans, task.pivots[rows].T, task.nominal[rows].T,
                setting.domain.lean_plane.reshape(-1, 1),
                at.transform.rotation.T.reshape(-1, 1), at.transform.translation[:, None], touching.T,
            )  # fmt: skip
            return found.reshape(13, len(at.margins.limits), len(rows)).transpose(2, 1, 0)

        return slopes

    def _best_step(self, setting: Setting, at: Candidate, slopes: Slopes, room: Room | None, reach: float) -> _Step:
        """Return the step that promises most, by a linear program on the margins that are near the smallest."""
        from scipy.optimize import linprog  # noqa: PLC0415  heavy: only when planning

        everywhere = setting.values(at.margins, at.transform, at.coefficients)
        rows = np.unique(np.linspace(0, len(everywhere) - 1, min(len(everywhere), _CONSIDERED)).astype(np.intp))
        rows = np.union1d(rows, valleys(everywhere))
        rows = np.union1d(rows[valleys(everywhere[rows])], everywhere.argmin(axis=0))
        values = everywhere[rows]
        point, kind = np.nonzero(values < float(values.min()) + _NEAR)
        motion = setting.freedom.motion if setting.freedom.moves else setting.freedom.motion[:, :0]
        slope, count = slopes(setting, at, rows)[point, kind], motion.shape[1]
        field = by_field(setting.basis[rows][point], slope[:, 11:]) * setting.cone
        rising = np.hstack([-slope[:, :6] * REACH @ motion, -slope[:, 6:11] * _SLIDE_M, -field])
        share, steep = _cone(setting, at)
        kept, bound = [np.hstack([np.zeros((len(steep), count + 5)), steep])], [1.0 - share]
        if room is not None:
            left, by_step = room(np.zeros(6), at.transform.rotation, at.transform.translation)
            by_motion = -np.asarray(by_step) * REACH @ motion
            kept.append(np.hstack([by_motion, np.zeros((len(by_motion), rising.shape[1] - count))]))
            bound.append(np.asarray(left).ravel())
        limits = np.vstack(kept)
        ends = ((self._travel - setting.machine.slides) / _SLIDE_M).T.tolist()
        answer = linprog(
            np.append(np.zeros(rising.shape[1]), -1.0),
            A_ub=np.vstack([np.column_stack([rising, np.ones(len(rising))]), np.pad(limits, ((0, 0), (0, 1)))]),
            b_ub=np.append(values[point, kind] - float(values.min()), np.maximum(np.concatenate(bound), 0.0)),
            bounds=[
                *[(-reach, reach)] * count, *((max(-reach, a), min(reach, b)) for a, b in ends),
                *[(-reach, reach)] * field.shape[1], (0.0, None),
            ],
            method="highs-ds",
            options={"maxiter": 5_000},
        )  # fmt: skip
        x = np.zeros(rising.shape[1] + 1) if answer.x is None else np.asarray(answer.x, dtype=np.float64)
        change = (x[count + 5 : -1] * setting.cone).reshape(-1, 2)
        return _Step(REACH * (motion @ x[:count]), _SLIDE_M * x[count : count + 5], change, float(x[-1]))


def _cone(setting: Setting, at: Candidate) -> tuple[Floats, Floats]:
    """Return the shares of the cone that the steepest leans use in directions about theirs, and their derivatives."""
    steepness = setting.steepness(at.coefficients)
    steep = np.argsort(-steepness, kind="stable")[:_STEEPEST]
    steep = steep[steepness[steep] > _STEEP]
    outward = setting.leans(at.coefficients, steep) / (steepness[steep, None] * setting.cone)
    aside = np.cross(setting.task.nominal[steep], outward)
    shares, derivatives = [np.zeros(0)], [np.zeros((0, 2 * setting.basis.shape[1]))]
    for turn in _TANGENTS:
        direction = np.cos(turn) * outward + np.sin(turn) * aside
        shares.append(np.cos(turn) * steepness[steep])
        derivatives.append(by_field(setting.basis[steep], direction @ setting.domain.lean_plane.T))
    return np.concatenate(shares), np.concatenate(derivatives)
