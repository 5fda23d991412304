"""plan: the placement of the part, the component of the machine and the tilt of the tool, by optimisation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypedDict, Unpack

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.base.progress import Progress, silent
from pentapod.base.refusal import Refusal
from pentapod.kinematics.robot import Branch
from pentapod.machine.clearance.collision_world import NOTHING, CollisionWorld
from pentapod.machine.machine import Machine
from pentapod.numerics.threads import on_one_thread
from pentapod.planning.diagnosis import refusal
from pentapod.planning.limits.limit import LimitKind
from pentapod.planning.placement.base_reconfiguration import reconfigured
from pentapod.planning.placement.between import Ranges, clear_between
from pentapod.planning.placement.common_axes import OPTIONS as COMMON_AXES
from pentapod.planning.placement.common_axes import CommonAxesOptions, Searched, with_common_axis
from pentapod.planning.placement.own_leans import OwnLeans, leans_as_planned
from pentapod.planning.placement.placed_path import PlacedPath, Placement, UnplacedPath
from pentapod.planning.placement.search import SOLVERS, SearchOptions, SolverName, improved_from, search
from pentapod.planning.placement.secondary_objective import SecondaryObjective, improved, objective_of
from pentapod.planning.placement.sequential import SequentialSolver
from pentapod.planning.problem.constraints import FREE, PlacementConstraints
from pentapod.planning.problem.idle_tool import without_idle_tool
from pentapod.planning.problem.problem import Candidate, PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.planning.problem.tilt_field import lean
from pentapod.planning.problem.weights import EVEN, NEEDED_MARGIN, Weights
from pentapod.planning.tool_axis.spline import AxisSpline
from pentapod.toolpath.toolpath import Toolpath

FEW = 500
"""Waypoints at which is looked first whether a part of a path fits."""

KEPT_SHARE = 0.9
"""Share of the best smallest margin that is kept while the axis is smoothed."""


class PlacementOptions(TypedDict):
    """The options of `plan` that `fits` takes, too."""

    tilt: float
    common_axis: bool | CommonAxesOptions
    constraints: PlacementConstraints
    component: Branch | None
    collision_world: CollisionWorld
    weights: Weights
    limits: Sequence[LimitKind]
    solver: SolverName


@on_one_thread
def plan(
    toolpath: Toolpath,
    machine: Machine,
    *,
    tilt: float = 0.0,
    common_axis: bool | CommonAxesOptions = False,
    constraints: PlacementConstraints = FREE,
    component: Branch | None = None,
    collision_world: CollisionWorld = NOTHING,
    weights: Weights = EVEN,
    secondary_objective: SecondaryObjective | None = None,
    limits: Sequence[LimitKind] = (),
    seed: int = 0,
    solver: SolverName = "sequential",
    start: PlacedPath | None = None,
    meetings: Callable[[PlacedPath], Ranges] | None = None,
    progress: Progress = silent,
) -> PlacedPath | Refusal:
    """Return placement, component and tool axes that maximise the smallest margin of the machine's limits on the path.

    tilt: half angle in radians of the cone around the nominal axis within which the tool may lean. common_axis: whether
    nominal axes between the toolpath's and one common direction are found as well, and which ones are compared; `tilt`
    is then the largest angle from the toolpath's axis. constraints: the allowed placements. component: all are searched
    where none is given. collision_world: obstacles of legs, spindle and tool. weights: of the groups of margins. The
    rail positions of a reconfigurable machine are optimised, too. secondary_objective: up to a tenth of the margin is
    given up for it. limits: kinds of limits besides pentapod's own. Deterministic for a seed. start: plan of nearly the
    same path on this machine; where it keeps the limits, so does what is found near its leans at its placement; else
    both are improved, and there is no other search. meetings: returns the ranges of waypoints between which the tool of
    a placed path meets the part; the leans get more room there, as far as possible.

    Returns a Refusal that names limits, waypoints and shortfalls where the part does not fit. An interruption (Ctrl-C)
    ends the search with the best placement so far, if that fits; else KeyboardInterrupt is raised.

    >>> placed = plan(toolpath, machine, constraints=PlacementConstraints.fixture([here])).unwrap()
    >>> placed.smallest_margin > 0.1
    True
    """
    samples, limit = _samples(toolpath, tilt, common_axis), tilt if common_axis else 0.0
    whole = PlacementProblem.of(
        samples, machine, constraints, weights,
        component=component, collision_world=collision_world, limits=limits,
    )  # fmt: skip

    def path(problem: PlacementProblem, at: Candidate, leans: Floats, chosen_by: str) -> PlacedPath:
        if meetings is None or problem.samples.tilt == 0.0:
            return _path(toolpath, problem, at, leans, chosen_by)
        # Margins and meetings of a long path take seconds: the path that was looked at is the one returned.
        made, meet = list[tuple[Floats, PlacedPath]](), meetings

        def met(leans: Floats) -> Ranges:
            made.append((leans, _path(toolpath, problem, at, leans, chosen_by)))
            return meet(made[-1][1])

        found = clear_between(problem, at, leans, met, progress)
        return next(placed for leans, placed in made if leans is found)

    def planned(rows: Ints) -> PlacedPath | Refusal:
        problem = whole.at(rows)
        if start is None:
            problem, found = _searched(problem, tilt, common_axis, seed, solver, progress)
        else:
            problem = _beside(problem, start)
            found = improved_from(problem, start.component, start.placement.transform)
        best = found.best
        everywhere = problem.at_all(samples)
        if best.smallest < NEEDED_MARGIN:
            own = OwnLeans.of(everywhere, best).in_best_cone(toolpath.axes, limit)
            along = own.along_path(progress)
            if along is None:
                return _refusal(toolpath, own)
            return path(own.problem, best, along, found.choice)
        keep = max(KEPT_SHARE * best.smallest, NEEDED_MARGIN)
        if secondary_objective is not None and (constraints.moves or problem.samples.tilt > 0.0):
            progress("placement", 1.0, f"margin {best.smallest:.3f}; now the objective {secondary_objective}")
            objective = objective_of(secondary_objective, problem, toolpath, rows)
            best = improved(SequentialSolver(problem, constraints.moves), best, objective, keep)
        leans = problem.leans(best.coefficients)
        if problem.samples.tilt > 0.0:
            progress("tool axis", 0.0, f"smallest margin {best.smallest:.3f}")
            smooth = SOLVERS[solver](problem, False).smooth(best, min(keep, best.smallest), progress)
            leans = leans if smooth is None else AxisSpline.of(problem.samples, problem.cone).leans(smooth)
        placed = path(everywhere, best, everywhere.samples.spread(leans, rows), found.choice)
        if len(rows) < len(toolpath) and not placed.keeps(NEEDED_MARGIN):
            # A waypoint that does not shape the path may all the same be out of limits.
            return planned(np.arange(len(toolpath)))
        return placed

    if start is not None:
        again = _as_planned(toolpath, _beside(whole, start), start, limit, progress)
        if again is not None:
            return path(*again, start.placement.chosen_by)
    return planned(samples.shaping(toolpath.starts))


@on_one_thread
def fits(toolpath: Toolpath, machine: Machine, **options: Unpack[PlacementOptions]) -> bool:
    """Return whether `plan` finds a placement, without smoothing the axes.

    Raises KeyboardInterrupt where the search is interrupted.
    """
    tilt, common_axis = options["tilt"], options["common_axis"]
    samples = _samples(toolpath, tilt, common_axis)
    problem = PlacementProblem.of(
        samples, machine, options["constraints"], options["weights"],
        component=options["component"], collision_world=options["collision_world"], limits=options["limits"],
    ).at(samples.shaping(toolpath.starts))  # fmt: skip
    # What does not fit at a few waypoints does not fit at all of them, and to look at many is most of a search.
    looks = [(problem, NEEDED_MARGIN)]
    if len(problem.basis) > 2 * FEW:
        looks.insert(0, (problem.at(np.sort(problem.samples.representatives(FEW))), 0.0))
    for some, needed in looks:
        _, found = _searched(some, tilt, common_axis, 0, options["solver"], silent)
        if found.interrupted:
            raise KeyboardInterrupt
        if found.best.smallest < needed:
            return False
    return True


def _samples(toolpath: Toolpath, tilt: float, common_axis: bool | CommonAxesOptions) -> ToolpathSamples:
    """Return the samples of a toolpath with the cone of its tilt field."""
    return ToolpathSamples.of(toolpath, min(tilt, _compared(common_axis).tilt) if common_axis else tilt)


def _compared(common_axis: bool | CommonAxesOptions) -> CommonAxesOptions:
    return common_axis if isinstance(common_axis, CommonAxesOptions) else COMMON_AXES


def _searched(
    problem: PlacementProblem,
    tilt: float,
    common_axis: bool | CommonAxesOptions,
    seed: int,
    solver: SolverName,
    progress: Progress,
) -> Searched:
    """Return the search and its problem: that of a reconfigurable machine at the rail positions found."""
    world = problem.margins[0].scene.collision_world
    bare = problem.in_world(replace(world, tool=())).margins

    def without_idle(problem: PlacementProblem) -> PlacementProblem:
        idle = without_idle_tool(world, problem.machine, problem.samples) is not world
        return replace(problem, margins=bare) if idle else problem

    def searched(problem: PlacementProblem, options: SearchOptions) -> Searched:
        if problem.machine.guides is not None:
            return reconfigured(problem, seed=seed, solver=solver, progress=progress)
        return problem, search(problem, seed=seed, solver=solver, progress=progress, options=options)

    limit, options = tilt if common_axis else 0.0, _compared(common_axis)
    return with_common_axis(
        problem, limit, searched, without_idle=without_idle, seed=seed, progress=progress, options=options
    )


def _beside(problem: PlacementProblem, start: PlacedPath) -> PlacementProblem:
    """Return the problem with the rail positions and the common direction of a plan of nearly the same path."""
    if start.placement.rail_positions is not None:
        problem = problem.on(problem.machine.at(start.placement.rail_positions))
    if start.common_axis is not None:
        problem = problem.along(problem.samples.towards(start.common_axis))
    return problem


def _as_planned(
    toolpath: Toolpath, problem: PlacementProblem, start: PlacedPath, limit: float, progress: Progress
) -> tuple[PlacementProblem, Candidate, Floats] | None:
    """Return problem, candidate and leans (N, 3) of a plan of nearly the same path; None where limits are not kept."""
    here = problem.constraints.nearest_to(start.placement.transform)
    margins = next((each for each in problem.margins if each.scene.branch == start.component), None)
    if not start.keeps(NEEDED_MARGIN) or margins is None:
        return None
    at = problem.candidate(margins, here, problem.upright)
    found = leans_as_planned(problem, at, toolpath, start, limit, progress)
    return None if found is None else (found[0], at, found[1])


def _path(toolpath: Toolpath, problem: PlacementProblem, at: Candidate, leans: Floats, chosen_by: str) -> PlacedPath:
    """Return the path at a candidate's placement with leans (N, 3), workpiece frame."""
    return _with_margins(toolpath, problem, at, chosen_by, _posed(problem, at, leans))


def _posed(problem: PlacementProblem, at: Candidate, leans: Floats) -> tuple[Floats, Floats, Floats]:
    """Return tips, axes (N, 3) and margins (N, M) at a candidate's placement."""
    tips, axes = problem.samples.machine_poses(at.transform, lean(problem.samples.nominal, leans))
    return tips, axes, at.margins(tips, axes, at.transform)


def _with_margins(
    toolpath: Toolpath, problem: PlacementProblem, at: Candidate, chosen_by: str, posed: tuple[Floats, Floats, Floats]
) -> PlacedPath:
    rail_positions = None if problem.machine.guides is None else tuple(problem.machine.rail_positions.tolist())
    placement = Placement(at.transform, chosen_by, rail_positions)
    branch, common_axis = at.margins.scene.branch, problem.samples.common_axis
    return PlacedPath(toolpath, placement, branch, *posed, at.margins.limits, common_axis)


def _refusal(toolpath: Toolpath, own: OwnLeans) -> UnplacedPath:
    """Return why a path does not fit at the best placement found; what fits as it leans there needs no other tilts."""
    problem, best = own.problem, own.at
    # Where each fits by itself, no smooth leans were found.
    posed = _posed(problem, best, own.nearest if own.fit and problem.samples.tilt > 0.0 else own.mixed)
    attempt, values = _with_margins(toolpath, problem, best, "best attempt", posed), posed[-1]
    if not own.fit:
        values[own.rows] = own.margins
    return refusal(values, attempt, best.margins, NEEDED_MARGIN, fixed=not problem.constraints.moves)
