"""Settings: tool axes and placements of a job, with estimates of how well they fit the whole task, or less of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial.distance import pdist

from pentapod.base.refusal import Shortfall
from pentapod.geometry.directions import normalised
from pentapod.job.advice.axes import AxisChoice, Changes, axis_choices
from pentapod.job.advice.options import AdviceOptions
from pentapod.job.advice.places import Place, places
from pentapod.job.advice.sketch import Sketch
from pentapod.job.build.limits import placement_limits
from pentapod.job.build.placement import job_weights
from pentapod.job.build.reach import farthest_apart
from pentapod.job.build.specification import job_collision_world
from pentapod.job.build.tool import job_tool
from pentapod.job.schema.job import Job
from pentapod.machine.clearance.collision_world import PART
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.planning.estimate import Estimate, Estimator
from pentapod.planning.problem.common_axis import CommonAxis
from pentapod.planning.problem.constraints import FREE
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples
from pentapod.toolpath.toolpath import Toolpath
from pentapod.verify.surface.surface_left import SURFACE_LEFT

Tell = Callable[[str], None]
"""Takes words for what is tried."""

TOUCHES = ("tool body", "the tool touches")
"""Beginnings of the names of limits and claims that keep shank, stem and holder from the part."""

ABOVE_THE_TIP = (*TOUCHES, "spindle touches")
"""Beginnings of the names of limits that depend on the tool's direction on the part, and not on where this stands."""

LEFT_ALONE = frozenset((SURFACE_LEFT,))
"""What fails where the tool leaves too much, wherever the part is placed."""


def touches_the_part(each: Shortfall) -> bool:
    """Return whether a shortfall is that the tool, above its tip, or the spindle touches the part."""
    return each.constraint.startswith(ABOVE_THE_TIP) and f"touches the {PART}" in each.constraint


def met_below(
    job: Job, mesh: Mesh | None, toolpath: Toolpath | None, short: Sequence[Shortfall], options: AdviceOptions
) -> tuple[float, ...]:
    """Return heights along the region's direction, metres, below which the tool or the spindle touches the part.

    They are heights of the cutter's contacts, since a region's box bounds these. Below the first are nearly all such
    places, below the last are all. Empty where a placement has other shortfalls.
    """
    if mesh is None or toolpath is None or not short or not all(touches_the_part(each) for each in short):
        return ()
    rows = np.concatenate([np.arange(a, b + 1) for each in short for a, b in each.waypoints])
    tool = job_tool(job)
    contacts = Sketch.of_waypoints(job, mesh, tool, toolpath, rows).contacts
    heights = contacts @ normalised(job.part.si.region_direction)
    if tool.tilt_centre == 0.0 and job.axis.mode not in ("normal", "auto"):  # contacts are on the rounding of the end
        heights = heights + (tool.scallop_radius or 0.0)
    return tuple(dict.fromkeys(np.quantile(heights, (options.nearly_all, 1.0)).tolist()))


@dataclass(frozen=True, eq=False)
class Trial:
    """Changes to plan. kept, whole: as in `Advice`; worth: those of more worth are planned first."""

    words: str
    changes: Changes
    kept: float
    worth: float
    whole: bool = True


@dataclass(frozen=True, eq=False)
class Setting:
    """Tool axes and a placement, and what was estimated for a task with them."""

    axis: AxisChoice
    place: Place
    found: Estimate

    @property
    def changes(self) -> Changes:
        """The changes of the job."""
        return merged(self.axis.changes, self.place.changes(self.found.candidate.transform))

    @property
    def words(self) -> str:
        """What is changed, in words; empty for the job's own setting."""
        return joined(self.axis.words, self.place.words)

    @property
    def touches(self) -> bool:
        """Whether shank, stem or holder touch the part where all else fits."""
        return any(each.constraint.startswith(TOUCHES) for each in self.found.shortfalls)


@dataclass(frozen=True, eq=False)
class Settings:
    """The settings of one job, and estimates for them. sketch: of its toolpath, where that is known."""

    job: Job
    machine: Machine
    mesh: Mesh
    sketch: Sketch
    toolpath: Toolpath | None
    options: AdviceOptions
    tell: Tell

    @cached_property
    def estimator(self) -> Estimator:
        """Estimates on the machine. Raises JobError where the tool does not go with it."""
        world = job_collision_world(self.job, self.machine, self.mesh)
        return Estimator.of(
            PlacementProblem.of(
                self.sketch.samples(self.sketch.axes, 0.0), self.machine, FREE, job_weights(self.job),
                collision_world=world, limits=placement_limits(self.job),
            )
        )  # fmt: skip

    @cached_property
    def places(self) -> list[Place]:
        """The job's own placements, and wider ones."""
        return places(self.job, self.machine, self.mesh, self.sketch, self.options)

    @cached_property
    def axes(self) -> list[AxisChoice]:
        """The job's own tool axes, and others."""
        tool = job_tool(self.job, self.machine)
        return axis_choices(self.job, tool, self.sketch, self.places[0].constraints, self.options)

    @cached_property
    def farthest(self) -> float:
        """Distance of two places, metres, beyond which no set-up reaches both."""
        return farthest_apart(self.job, self.machine)

    @cached_property
    def looked_at(self) -> list[Setting]:
        """The settings that were estimated for the whole task so far, but for places where nobody builds a table."""
        return []

    @cached_property
    def nearest(self) -> Setting | None:
        """The setting with the largest margin for the whole task; None where it was not estimated."""
        return max(self.looked_at, key=lambda setting: setting.found.margin, default=None)

    def share_in_reach(self, sketch: Sketch) -> float:
        """Return the share of a sketch's extents, up to 1, beyond which it is too wide for one set-up."""
        return min(self.farthest / max(_width(sketch), 1e-300), 1.0)

    @cached_property
    def usual_share(self) -> float:
        """Share of the task's extents, up to 1, with which it is as wide as the machine's work volume."""
        return min(self.machine.work.diameter / max(_width(self.sketch), 1e-300), 1.0)

    def of(self, place: Place) -> Iterator[AxisChoice]:
        """Yield the tool axes to try with one placement."""
        yield from (axis for axis in self.axes if not place.words or not axis.narrow)

    def setting(self, axis: AxisChoice, place: Place) -> Setting:
        """Return the setting of the whole task."""
        self.tell(joined(axis.words, place.words))
        setting = Setting(axis, place, self._best(axis.kinds(self.sketch), place, None, obstacles=True))
        if self.is_usual(setting):
            self.looked_at.append(setting)
        return setting

    def is_usual(self, setting: Setting) -> bool:
        """Return whether a setting's table holds the task within the work volume's width of its middle.

        Elsewhere there may be a place, too, as beside the base: nobody builds a table there.
        """
        if not setting.place.words or setting.place.constraints is FREE:
            return True
        middle = setting.found.candidate.transform.apply(self.sketch.contacts.mean(axis=0))
        return bool(np.linalg.norm(middle - self.machine.work.centre) <= self.machine.work.diameter)

    def first_that_fits(self, sketch: Sketch) -> Setting | None:
        """Return the first setting in which a part of the task fits comfortably, else the best that fits at all."""
        best: Setting | None = None
        for place in self.places:
            for axis in self.of(place):
                self.tell(joined(axis.words, place.words))
                found = Setting(axis, place, self._best(axis.kinds(sketch), place, None, obstacles=True))
                if not self.is_usual(found):
                    continue
                if found.found.margin >= self.options.comfortable:
                    return found
                if best is None or found.found.margin > best.found.margin:
                    best = found
            if best is not None and best.found.margin >= self.options.enough:
                return best
        return None

    def beyond_a_single_place(self) -> tuple[Shortfall, ...]:
        """Return the limits that are exceeded wherever a single place of the task is; empty where it can be reached.

        Any pose of the tool will do, and the part is left out.
        """
        middle = int(np.linalg.norm(self.sketch.contacts - self.sketch.contacts.mean(axis=0), axis=1).argmin())
        rows = np.array([middle, middle])
        kept = {name: getattr(self.sketch, name)[rows] for name in ("contacts", "normals", "axes")}
        one = replace(self.sketch, **kept)
        bare = replace(self.estimator, world=None)
        found = bare.best([one.samples(one.axes, 0.0)], FREE, None, self.options.enough)
        return found.shortfalls if found.margin < 0.0 else ()

    def less(
        self, base: Setting, sketch: Sketch, near: Estimate | None = None, *, obstacles: bool = True
    ) -> Estimate | None:
        """Return the estimate for less than the whole task, with axes of the kind that was best for it.

        None where it is still too wide for one set-up. near: an estimate of a similar task to begin with.
        """
        if self.share_in_reach(sketch) < 1.0:
            return None
        own, kinds = base.found.samples.common_axis, base.axis.kinds(sketch)
        alike = [each for each in kinds if _cone(each.common_axis) == _cone(own)]
        return self._best(alike or kinds, base.place, near, obstacles=obstacles)

    def without_obstacles(self) -> Estimate:
        """Return the estimate for the whole task with the job's own axes and placement, without part and fixture."""
        return self._best(self.axes[0].kinds(self.sketch), self.places[0], None, obstacles=False)

    def fits(self, found: Estimate | None) -> bool:
        """Return whether an estimate is good enough for a plan."""
        return found is not None and found.margin >= self.options.enough

    def largest(self, estimated: Callable[[float, Estimate | None], Estimate | None], first: float) -> float:
        """Return the largest share of the part that fits, by bisection; 0 where none does.

        estimated: takes a share and the estimate before it, None at first, and returns None where nothing is left. What
        is too wide for one set-up is not estimated. first: share to begin with, of the work volume if that is smaller.
        """
        too_large, least = self.share_in_reach(self.sketch), self.options.least * self.usual_share
        fits, share, near = 0.0, min(first * self.usual_share, 0.5 * too_large if too_large < 1.0 else first), None
        for _ in range(self.options.halvings):
            found = estimated(share, near)
            if self.fits(found):
                fits = share
            else:
                too_large = share
            near, share = found or near, min(0.5 * (fits + too_large), 2.0 * fits or too_large)
            if share < least:
                break
        return fits

    def _best(self, kinds: list[ToolpathSamples], place: Place, near: Estimate | None, *, obstacles: bool) -> Estimate:
        estimator = self.estimator if obstacles else replace(self.estimator, world=None)
        return estimator.best(kinds, place.constraints, place.component, self.options.comfortable, near)


def _width(sketch: Sketch) -> float:
    """Return the largest distance between two points of a sketch, metres."""
    return float(pdist(sketch.contacts).max()) if len(sketch.contacts) > 1 else 0.0


def _cone(common_axis: CommonAxis | None) -> float | None:
    """Return the cone of axes around a common direction; None where they are the path's own."""
    return None if common_axis is None else common_axis.cone


def joined(*words: str) -> str:
    """Return words that are not empty, with commas."""
    return ", ".join(each for each in words if each)


def merged(*changes: Changes) -> Changes:
    """Return several changes as one; later ones win."""
    found: Changes = {}
    for each in changes:
        for table, keys in each.items():
            found[table] = {**found.get(table, {}), **keys}
    return found
