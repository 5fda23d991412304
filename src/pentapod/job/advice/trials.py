"""Trials: changes of a job that fit by an estimate, those first that keep most of the task."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice, pairwise

import numpy as np

from pentapod.base.errors import InputError
from pentapod.base.units import from_si, to_si
from pentapod.job.advice.axes import AxisChoice, Changes, axis_choices
from pentapod.job.advice.options import AdviceOptions
from pentapod.job.advice.parts import Regions, Smaller
from pentapod.job.advice.places import Place, places
from pentapod.job.advice.sketch import Sketch
from pentapod.job.build.limits import placement_limits
from pentapod.job.build.placement import job_weights
from pentapod.job.build.specification import job_collision_world
from pentapod.job.build.tool import job_tool
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.planning.estimate import Estimate, Estimator
from pentapod.planning.problem.common_axis import CommonAxis
from pentapod.planning.problem.constraints import FREE
from pentapod.planning.problem.problem import PlacementProblem
from pentapod.planning.problem.samples import ToolpathSamples

Tell = Callable[[str], None]
"""Takes words for what is tried."""

FEWEST = 4
"""Points below which a sketch shows nothing."""


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
    """Tool axes and a placement, and what was estimated for the whole task with them."""

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


@dataclass(frozen=True, eq=False)
class Trials:
    """The trials of one job."""

    job: Job
    machine: Machine
    mesh: Mesh
    sketch: Sketch
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
    def looked_at(self) -> list[Setting]:
        """The settings that were estimated so far."""
        return []

    def all(self, own: bool) -> Iterator[Trial]:
        """Yield the trials, the best first as far as that is known. own: whether the job as it is counts as one."""
        yield from self._keeping_all(own)
        for base in self._bases():
            yield from self._smaller(base)
        yield from self._scales(self._bases()[0])

    def _keeping_all(self, own: bool) -> Iterator[Trial]:
        """Yield changes of tool axes and placement; the cheapest to plan first, once they fit comfortably."""
        for place in self.places:
            yield from islice(self._in_place(place, own), self.options.failures)

    def _in_place(self, place: Place, own: bool) -> Iterator[Trial]:
        """Yield other tool axes with one placement; those that fit comfortably as soon as they are found."""
        scant: list[Setting] = []
        for axis in (axis for axis in self.axes if place is self.places[0] or not axis.narrow):
            setting = self._setting(axis, place)
            if not (own or setting.words) or setting.found.margin < self.options.enough:
                continue
            if setting.found.margin < self.options.comfortable:
                scant.append(setting)
            else:
                yield Trial(setting.words, setting.changes, 1.0, 1.0)
        for setting in sorted(scant, key=lambda s: -s.found.margin):
            yield Trial(setting.words, setting.changes, 1.0, 1.0)

    def _setting(self, axis: AxisChoice, place: Place) -> Setting:
        self.tell(joined(axis.words, place.words))
        setting = Setting(axis, place, self._best(axis.kinds(self.sketch), place, None, obstacles=True))
        self.looked_at.append(setting)
        return setting

    def _bases(self) -> list[Setting]:
        """Return the settings from which other changes start: the best one, and the job's own."""
        best, own = max(self.looked_at, key=lambda setting: setting.found.margin), self.looked_at[0]
        return [own] if best is own else [best, own]

    def _smaller(self, base: Setting) -> Iterator[Trial]:
        """Yield changes that keep less, or need more set-ups or another tool."""
        yield from self._setups(base)
        regions = sorted(self._regions(base), key=lambda trial: -trial.worth)
        yield from (trial for trial in regions if trial.worth >= self.options.worth_length)
        yield from self._lengths(base)
        yield from (trial for trial in regions if trial.worth < self.options.worth_length)

    def _regions(self, base: Setting) -> list[Trial]:
        """Return the largest smaller regions that fit: flatter ones, and boxes."""
        regions = Regions.of(self.job, self.mesh, self.sketch.tool, self.options)
        if regions is None:
            return []
        found: list[Smaller] = []
        self.tell("a smaller region_angle_deg")
        near: Estimate | None = None
        for degrees in self.options.angles_deg:
            if (smaller := regions.flatter(degrees)) is None:
                continue
            near = self._less(base, smaller.sketch, near)
            if near.margin >= self.options.enough:
                found.append(smaller)
                break
        self.tell("a smaller region_box_mm")
        for deep in (False, True):
            found += self._boxes(base, regions, deep=deep)
        return [self._of_region(base, smaller) for smaller in found]

    def _of_region(self, base: Setting, smaller: Smaller) -> Trial:
        changes, words = merged(base.changes, smaller.changes), joined(smaller.words, base.words)
        return Trial(words, changes, smaller.share, smaller.share)

    def _boxes(self, base: Setting, regions: Regions, *, deep: bool) -> list[Smaller]:
        """Return about the largest box that fits, by bisection, and a smaller one, in case its plan fails."""

        def estimated(share: float, near: Estimate | None) -> Estimate | None:
            smaller = regions.boxed(share, deep=deep)
            return None if smaller is None else self._less(base, smaller.sketch, near)

        fits = self._largest(estimated, self.options.first)
        if fits == 0.0:
            return []
        boxes = (regions.boxed(factor * fits, deep=deep) for factor in (self.options.spare, self.options.smaller))
        return [box for box in boxes if box is not None]

    def _setups(self, base: Setting) -> Iterator[Trial]:
        """Yield the smallest number of set-ups whose slabs fit."""
        if not base.place.constraints.moves:
            return
        self.tell("more placement.setups")
        for count in self.options.setups:
            for along in np.argsort(-np.ptp(self.sketch.contacts, axis=0))[:2].tolist():
                at = self.sketch.contacts[:, along]
                borders = pairwise(np.linspace(at.min(), at.max(), count + 1).tolist())
                parts = [self.sketch.within(low, high, along) for low, high in borders]
                parts = [part for part in parts if len(part.contacts) >= FEWEST]
                margins = (self._less(base, part).margin for part in parts)
                if count > self.job.placement.setups and all(margin >= self.options.enough for margin in margins):
                    changes = merged(base.changes, {"placement": {"setups": count}})
                    yield Trial(joined(f"up to {count} set-ups", base.words), changes, 1.0, 1.0)
                    return

    def _lengths(self, base: Setting) -> Iterator[Trial]:
        """Yield the first other tool length that fits."""
        self.tell("another tool.length_mm")
        for share in self.options.lengths:
            length = round(float(from_si(share * self.machine.tool_length, "mm")))
            try:
                other = replace(self, machine=self.machine.with_tool(to_si(length, "mm")))
                margin = other._less(base, self.sketch).margin
            except InputError:  # the spindle or the holder would not fit
                continue
            if margin >= self.options.enough:
                changes = merged(base.changes, {"tool": {"length_mm": float(length)}})
                yield Trial(joined(f"a tool of {length} mm", base.words), changes, 1.0, self.options.worth_length)
                return

    def _scales(self, base: Setting) -> Iterator[Trial]:
        """Yield the largest scale that fits, by bisection; it makes another part."""
        self.tell("a smaller part.scale")

        def estimated(share: float, near: Estimate | None) -> Estimate:
            return self._less(base, self.sketch.scaled(share), near, obstacles=False)

        fits = self._largest(estimated, 0.5)
        if fits > 0.0:
            size = self.options.spare * fits
            changes = merged(base.changes, {"part": {"scale": float(f"{size * self.job.part.scale:.3g}")}})
            yield Trial(joined(f"the part at {size:.2g} of its size", base.words), changes, 1.0, 0.0, whole=False)

    def _largest(self, estimated: Callable[[float, Estimate | None], Estimate | None], first: float) -> float:
        """Return the largest share of the part that fits, by bisection; 0 where none does.

        estimated: takes a share and the estimate before it, None at first, and returns None where nothing is left.
        """
        fits, too_large, share, near = 0.0, 1.0, first, None
        for _ in range(self.options.halvings):
            found = estimated(share, near)
            if found is not None and found.margin >= self.options.enough:
                fits = share
            else:
                too_large = share
            near, share = found or near, 0.5 * (fits + too_large)
            if share < self.options.least:
                break
        return fits

    def _less(self, base: Setting, sketch: Sketch, near: Estimate | None = None, *, obstacles: bool = True) -> Estimate:
        """Return the estimate for less than the whole task, with axes of the kind that was best for it."""
        own, kinds = base.found.samples.common_axis, base.axis.kinds(sketch)
        alike = [each for each in kinds if _cone(each.common_axis) == _cone(own)]
        return self._best(alike or kinds, base.place, near, obstacles=obstacles)

    def _best(self, kinds: list[ToolpathSamples], place: Place, near: Estimate | None, *, obstacles: bool) -> Estimate:
        estimator = self.estimator if obstacles else replace(self.estimator, world=None)
        return estimator.best(kinds, place.constraints, place.component, self.options.comfortable, near)


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
