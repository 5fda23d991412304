"""plan: where to clamp the part, in which component to work, and how to tilt the tool."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypedDict

from pentapod.base.arrays import Floats
from pentapod.base.progress import Progress, silent
from pentapod.base.refusal import Refusal
from pentapod.kinematics.component import Component
from pentapod.machine.clearance.collision_world import NOTHING, Surroundings
from pentapod.machine.machine import Machine
from pentapod.numerics.one_thread import on_one_thread
from pentapod.planning.diagnosis import refusal
from pentapod.planning.placement.base_reconfiguration import guided
from pentapod.planning.placement.placed_path import PlacedPath, UnplacedPath
from pentapod.planning.placement.placement import Placement
from pentapod.planning.placement.sampling import best_tilted_margins
from pentapod.planning.placement.search import SOLVERS, Search, Solver, SolverName, search
from pentapod.planning.placement.secondary_objective import SecondAim, aim_of, improved
from pentapod.planning.placement.sequential import SequentialSolver
from pentapod.planning.problem.constraints import FREE, Freedom
from pentapod.planning.problem.problem import Candidate, Setting
from pentapod.planning.problem.samples import Task
from pentapod.planning.problem.tilt_field import lean
from pentapod.planning.problem.weights import EVEN, NEEDED_MARGIN, Weights
from pentapod.planning.suggestions import remedies
from pentapod.planning.tool_axis.spline import AxisCourse
from pentapod.toolpath.toolpath import Toolpath

CALM_SHARE = 0.9
"""Share of the best smallest margin that is kept when the axis is made calm."""


class Wishes(TypedDict):
    """What `plan` and `fits` are told of a placement."""

    tilt: float
    freedom: Freedom
    component: Component | None
    surroundings: Surroundings
    weights: Weights
    solver: SolverName


@on_one_thread
def plan(
    toolpath: Toolpath,
    machine: Machine,
    *,
    tilt: float = 0.0,
    freedom: Freedom = FREE,
    component: Component | None = None,
    surroundings: Surroundings = NOTHING,
    weights: Weights = EVEN,
    then: SecondAim | None = None,
    seed: int = 0,
    solver: SolverName = "sequential",
    progress: Progress = silent,
) -> PlacedPath | Refusal:
    """Choose placement, component and tool axes that keep the path well inside the machine's limits.

    tilt: half angle in radians of the cone around the nominal axis within which the tool may lean.
    freedom: the allowed placements; of them, and of all components where none is given, the one with the largest
    smallest margin is kept, the margins weighed by `weights`; a machine's guides are chosen with it. surroundings: what
    legs, spindle and tool must not touch.
    then: second aim, for which up to a tenth of that margin is given. Deterministic for a seed. Returns a Refusal that
    names limits, waypoints and shortfalls where the part does not fit. An interruption (Ctrl-C) of the search for a
    placement ends it with the best found so far, if that fits; else KeyboardInterrupt is raised.
    """
    setting = Setting.of(Task.of(toolpath, tilt), machine, freedom, weights)
    setting, found = _searched(setting, component, surroundings, seed, solver, progress)
    best = found.best
    if best.smallest < NEEDED_MARGIN:
        progress("placement", 1.0, "it does not fit; looking for what would")
        return _refusal(toolpath, setting, best, SOLVERS[solver])
    keep = max(CALM_SHARE * best.smallest, NEEDED_MARGIN)
    if then is not None and (freedom.moves or tilt > 0.0):
        progress("placement", 1.0, f"margin {best.smallest:.3f}; now for {then}")
        best = improved(SequentialSolver(setting, freedom.moves), best, aim_of(then, setting, toolpath), keep)
    leans = setting.leans(best.coefficients)
    if tilt > 0.0:
        progress("tool axis", 0.0, f"smallest margin {best.smallest:.3f}")
        calm = SOLVERS[solver](setting, False).calm(best, min(keep, best.smallest))
        leans = leans if calm is None else AxisCourse.of(setting.task, setting.cone).leans(calm)
    return _path(toolpath, setting, best, leans, found.choice)


@on_one_thread
def fits(
    toolpath: Toolpath,
    machine: Machine,
    *,
    tilt: float,
    freedom: Freedom,
    component: Component | None,
    surroundings: Surroundings,
    weights: Weights,
    solver: SolverName,
) -> bool:
    """Return whether `plan` finds a placement: the quick answer, without axes along the path and without remedies.

    Raises KeyboardInterrupt where the search is interrupted.
    """
    setting = Setting.of(Task.of(toolpath, tilt), machine, freedom, weights)
    _, found = _searched(setting, component, surroundings, 0, solver, silent)
    if found.interrupted:
        raise KeyboardInterrupt
    return found.best.smallest >= NEEDED_MARGIN


def _searched(
    setting: Setting,
    component: Component | None,
    surroundings: Surroundings,
    seed: int,
    solver: SolverName,
    progress: Progress,
) -> tuple[Setting, Search]:
    """Return what the search found, and the setting: with its machine's guides as chosen, where it has some."""
    if setting.machine.guides is not None:
        return guided(setting, component, surroundings, seed=seed, solver=solver, progress=progress)
    return setting, search(setting, component, surroundings, seed=seed, solver=solver, progress=progress)


def _path(toolpath: Toolpath, setting: Setting, at: Candidate, leans: Floats, chosen_by: str) -> PlacedPath:
    """Return the path at a candidate's placement with leans (N, 3), workpiece frame."""
    tips, axes = setting.task.machine_poses(at.transform, lean(setting.task.nominal, leans))
    slides = None if setting.machine.guides is None else tuple(setting.machine.slides.tolist())
    values = at.margins(tips, axes, at.transform)
    placement = Placement(at.transform, chosen_by, slides)
    return PlacedPath(toolpath, placement, at.margins.component, tips, axes, values, at.margins.limits)


def _refusal(
    toolpath: Toolpath, setting: Setting, best: Candidate, improves: Callable[[Setting, bool], Solver]
) -> UnplacedPath:
    values, leans = best_tilted_margins(setting.task, best.margins, best.transform)
    if (values.min(axis=1) >= NEEDED_MARGIN).all():  # each waypoint alone would do, not all with one smooth field
        leans = setting.leans(best.coefficients)
        poses = setting.task.machine_poses(best.transform, setting.axes(best.coefficients))
        values = best.margins(*poses, best.transform)

    def improve(other: Setting, start: Candidate) -> Candidate:
        return improves(other, True).raise_margin(start, NEEDED_MARGIN)

    found, fixed = remedies(setting, best, improve, NEEDED_MARGIN), not setting.freedom.moves
    attempt = _path(toolpath, setting, best, leans, "best attempt")
    return refusal(values, attempt, best.margins, NEEDED_MARGIN, found, fixed=fixed)
