"""plan: where to clamp the part, in which component to work, and how to tilt the tool."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, Protocol

from pentapod.arrays import Floats
from pentapod.geometry.rigid import RigidTransform
from pentapod.kinematics.component import COMPONENTS, Component
from pentapod.machine.machine import Machine
from pentapod.machine.surroundings import NOTHING, Surroundings
from pentapod.planning.blame import refusal
from pentapod.planning.freedom import FREE, Freedom
from pentapod.planning.ipopt import IpoptSolver
from pentapod.planning.margins import Margins
from pentapod.planning.placed_path import PlacedPath
from pentapod.planning.placement import Placement
from pentapod.planning.remedies import remedies
from pentapod.planning.sampling import best_tilted_margins, first_guesses
from pentapod.planning.sequential import SequentialSolver
from pentapod.planning.setting import Candidate, Setting
from pentapod.planning.task import Task
from pentapod.planning.tilt import lean
from pentapod.progress import Progress, silent
from pentapod.refusal import Refusal
from pentapod.toolpath.toolpath import Toolpath

SolverName = Literal["sequential", "ipopt"]

NEEDED_MARGIN = 0.02
"""A plan is accepted from this smallest margin on: what rounding corners between waypoints may cost."""

CALM_SHARE = 0.9
"""Share of the best smallest margin that is kept when the axis is made calm."""

REFINED = 4
"""How many first guesses are improved in any case."""

TRIED = 10
"""How many are improved at most, while none is good enough."""


class Solver(Protocol):
    """What improves candidates: `sequential`, the default, and `ipopt`, the reference."""

    def raise_margin(self, start: Candidate) -> Candidate:
        """Return a candidate near `start` with the largest smallest margin; never a worse one."""
        ...

    def calm(self, start: Candidate, keep: float) -> Floats | None:
        """Return coefficients of the setting's course: the calmest one that keeps the margin `keep`.

        At the placement of `start`, and from its leans on. None where no such course was found.
        """
        ...


def plan(
    toolpath: Toolpath,
    machine: Machine,
    *,
    tilt: float = 0.0,
    freedom: Freedom = FREE,
    component: Component | None = None,
    surroundings: Surroundings = NOTHING,
    seed: int = 0,
    solver: SolverName = "sequential",
    progress: Progress = silent,
) -> PlacedPath | Refusal:
    """Choose placement, component and tool axes that keep the path well inside the machine's limits.

    tilt: half angle in radians of the cone around the nominal axis within which the tool may lean.
    freedom: the allowed placements; of them, and of all components where none is given, the one with the largest
    smallest margin is kept. surroundings: what legs, spindle and tool must not touch. Deterministic for a seed. Returns
    a Refusal that names limits, waypoints and shortfalls where the part does not fit.
    """
    setting = Setting.of(Task.of(toolpath, tilt), machine, freedom)
    improves = SequentialSolver if solver == "sequential" else IpoptSolver
    components = COMPONENTS if component is None else (component,)
    if freedom.moves:
        progress("placement", 0.0, "sampling")
        guesses = first_guesses(setting.task, machine, components, seed, freedom=freedom, surroundings=surroundings)
        starts = [(Margins.of(machine, g.component, surroundings), g.transform) for g in guesses]
    else:
        starts = [(Margins.of(machine, c, surroundings), pose) for pose in freedom.poses for c in components]
    best: Candidate | None = None
    moving = improves(setting, freedom.moves)
    for k, (margins, transform) in enumerate(starts):
        if freedom.moves and k >= REFINED and best is not None and (best.smallest >= NEEDED_MARGIN or k >= TRIED):
            break
        found = moving.raise_margin(setting.first_candidate(margins, transform))
        if best is None or found.smallest > best.smallest:
            best = found
        progress("placement", (k + 1) / len(starts), f"component {best.margins.component}, margin {best.smallest:.3f}")
    if best is None:  # COMPONENTS is not empty, and first_guesses returns some for each
        raise RuntimeError("no first guess was made")
    if best.smallest < NEEDED_MARGIN:
        progress("placement", 1.0, "it does not fit; looking for what would")
        return _refusal(setting, best, improves)
    leans = setting.leans(best.coefficients)
    if tilt > 0.0:
        progress("tool axis", 0.0, f"smallest margin {best.smallest:.3f}")
        calm = improves(setting, False).calm(best, max(CALM_SHARE * best.smallest, NEEDED_MARGIN))
        leans = leans if calm is None else setting.course.leans(calm)
    tips, axes = setting.task.machine_poses(best.transform, lean(setting.task.nominal, leans))
    chosen = Placement(best.transform, _choice(freedom, best.transform))
    names = tuple(limit.name for limit in best.margins.limits)
    return PlacedPath(
        toolpath, chosen, best.margins.component, tips, axes, best.margins(tips, axes, best.transform), names
    )


def _choice(freedom: Freedom, chosen: RigidTransform) -> str:
    """Return what a placement was chosen by."""
    if freedom.moves:
        return "largest smallest margin"
    if len(freedom.poses) == 1:
        return "job"
    return f"pose {1 + freedom.poses.index(chosen)} of {len(freedom.poses)} of the fixture: largest smallest margin"


def _refusal(setting: Setting, best: Candidate, improves: Callable[[Setting, bool], Solver]) -> Refusal:
    values, _ = best_tilted_margins(setting.task, best.margins, best.transform)
    if (values.min(axis=1) >= NEEDED_MARGIN).all():  # each waypoint alone would do, not all with one smooth field
        values = setting.values(best.margins, best.transform, best.coefficients)

    def improve(other: Setting, start: Candidate) -> Candidate:
        return improves(other, True).raise_margin(start)

    found = remedies(setting, best, improve, NEEDED_MARGIN)
    return refusal(values, best.margins, NEEDED_MARGIN, found, fixed=not setting.freedom.moves)
