"""Trials for a program that fails its own verdict: finer passes, a smaller cutter or region, less feed, no gouges.

What is left on the surface is estimated before a plan: how much less than before the cutter's ball leaves, on its way
along the toolpath, at points of the region.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pentapod.base.errors import InputError
from pentapod.base.units import from_si, to_si
from pentapod.cutters.mounted import BallEnded
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import normalised
from pentapod.job.advice.axes import CHOSEN, OF_MODES, WATERLINES, Changes, chosen_axis, taken_out
from pentapod.job.advice.options import AdviceOptions
from pentapod.job.advice.parts import Regions
from pentapod.job.advice.settings import Tell, Trial, merged
from pentapod.job.build.left import foreseen, uncovered
from pentapod.job.build.other_ways import NEARER, may_come_nearer
from pentapod.job.build.specification import job_collision_world, job_coverage, job_cutting
from pentapod.job.build.tool import job_tool
from pentapod.job.build.toolpath import drops_gouges, job_toolpath
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.toolpath.toolpath import SegmentKind, Toolpath
from pentapod.verify.claims import gouge, slowness
from pentapod.verify.surface import surface_left
from pentapod.verify.verdict.coverage import Coverage
from pentapod.verify.verdict.verdict import Certificate

_LEFT = surface_left.CLAIMS[0].name
_GOUGES = frozenset(claim.name for claim in gouge.CLAIMS)
_FEEDS = frozenset(claim.name for claim in slowness.CLAIMS)


@dataclass(frozen=True, eq=False)
class FailedClaims:
    """Trials for the claims of a job that fail, by name. toolpath: the job's, which its program follows.

    left: percent of the region that is left where a run does the job in another way, if nothing else fails there.
    leaves: share of the cuts at the few places where its placement exceeds limits, if no plan leaves them out yet.
    """

    job: Job
    machine: Machine
    mesh: Mesh
    toolpath: Toolpath
    failed: Mapping[str, Certificate]
    options: AdviceOptions
    tell: Tell
    left: float | None = None
    leaves: float | None = None

    def all(self) -> Iterator[Trial]:
        """Yield trials, the ones that keep most first. What gouges fails any verdict, so it is left out at once."""
        if _GOUGES & self.failed.keys() or not drops_gouges(self.job):
            yield from self._without_gouges()
        if _FEEDS & self.failed.keys():
            self.tell("a lower feed")
            feed = round(self.options.slower * self.job.feed.cut_mm_min, 1)
            yield Trial("a lower feed", {"feed": {"cut_mm_min": feed}}, 1.0, 1.0)
        if _LEFT in self.failed:
            yield from self._leaving_less()
        else:
            yield from self._as_left()
        if self.leaves is not None:
            yield self._told(staying(longer(self.options.more * self.leaves)))

    def at_last(self) -> Iterator[Trial]:
        """Yield the program as it is where nothing else was found, and more than a little is left."""
        if self.options.little < self._accepted <= self.options.largest:
            yield self._told(staying(self._accepted))

    def upright(self) -> Iterator[Trial]:
        """Yield the job without what a ball reaches only under an overhang, where the tool touches the part."""
        if getattr(self.job.toolpath, "under_mm", 0.0) == 0.0 or not isinstance(self._tool, BallEnded):
            return
        self.tell("only where an upright tool has room")
        changes: Changes = {"toolpath": {"under_mm": 0.0}}
        kept = self._kept(changes)
        if kept > 0.0:
            yield Trial("only where an upright tool has room", changes, min(kept, 1.0), kept)

    def reaching(self) -> Iterator[Trial]:
        """Yield the job with axes along which shank and holder are clear, where they forbid what the ball reaches."""
        view = [float(v) for v in normalised(self.job.part.si.region_direction)]
        along = {**taken_out(self.job, "axis", OF_MODES), "mode": "fixed", "direction": view}
        tries: list[tuple[str, Changes]] = []
        if self._tool.can_tilt:
            remedy = {"gouge": {"remedy": ["tilt", "drop"]}}
            tries.append(("the tool leans where shank or holder would touch the part", remedy))
        if self.job.axis.mode == "fixed":
            tries.append(("one direction of the tool for the whole path", {"axis": along}))
        for words, changes in tries:
            self.tell(words)
            if not self._forbidden(changes):
                yield Trial(words, changes, 1.0, 1.0)

    def _forbidden(self, changes: Changes) -> bool:
        """Return whether shank or holder forbid what the ball reaches with changes, or no toolpath can be made."""
        try:
            job = self.job.with_(**changes)
            toolpath, reports = job_toolpath(job, self.mesh, machine=self.machine)
            cutting = job_cutting(job, job_collision_world(job, self.machine, self.mesh), self.machine)
        except InputError:
            return True
        return foreseen(job, reports, toolpath, cutting) is not None

    def _without_gouges(self) -> Iterator[Trial]:
        """Yield the job without the motions that gouge, with the share of its cuts that are kept."""
        self.tell("without what gouges")
        changes: Changes = {"gouge": {"remedy": ["drop"]}}
        kept = self._kept(changes)
        if 0.0 < kept < self.options.most:
            yield Trial("what gouges is left out", changes, min(kept, 1.0), kept)

    def _kept(self, changes: Changes) -> float:
        """Return the share of the length of the cuts that is kept with changes; 0 where no toolpath can be made."""
        other = _toolpath_of(self.job, changes, self.machine, self.mesh)
        return 0.0 if other is None else _cut_length(other) / max(_cut_length(self.toolpath), 1e-300)

    @cached_property
    def _tool(self) -> Tool:
        return job_tool(self.job, self.machine)

    def _leaving_less(self) -> Iterator[Trial]:
        """Yield changes that leave less than the job now allows, where that can be estimated."""
        most, accepted = self._most, False
        long = len(self.toolpath) > self.options.long
        if self._accepted <= (self.options.little if long else self.options.hardly):
            yield from self._as_left()
            accepted = True
        for words, changes, left in self._finer():
            if left <= most:
                yield Trial(words, changes, 1.0, 1.0)
                if not accepted:  # the other ways cost a plan each, and are much like the one that failed
                    yield from self._as_left()
                accepted = True
        if not accepted:
            yield from self._as_left()
        if (regions := Regions.of(self.job, self.mesh, self._tool, self.toolpath, self.options)) is None:
            return
        self.tell("a smaller region_angle_deg")
        for degrees in self.options.angles_deg:
            smaller = regions.flatter(degrees)
            if smaller is not None and self._left(smaller.changes, self.toolpath) <= most:
                yield Trial(smaller.words, smaller.changes, smaller.share, smaller.share)
                return

    def _as_left(self) -> Iterator[Trial]:
        """Yield the program as it is, where nothing but a little that is left on the surface stands against it."""
        share = self._accepted
        if share <= self.options.little:
            yield self._told(staying(share))

    def _told(self, trial: Trial) -> Trial:
        self.tell(trial.words)
        return trial

    @property
    def _accepted(self) -> float:
        """Share of the region that would have to be left for a program to pass; infinite where that does not help."""
        own = self.failed[_LEFT].value if set(self.failed) == {_LEFT} else None
        left = min((each for each in (own, self.left) if each is not None), default=0.0)
        if own is not None and own <= self.options.about * left:  # judged on its program; another way is planned again
            left = own
        return longer(1e-2 * self.options.more * left) if left > 0.0 else np.inf

    def _finer(self) -> Iterator[tuple[str, Changes, float]]:
        """Yield waterlines on walls, passes nearer together with the same bound of what is left, a smaller cutter.

        Each with the share of the region on which it leaves too much.
        """
        table = self.job.toolpath
        region, steep = self._coverage.region, self.options.steep_deg
        view = normalised(self.job.part.si.region_direction)
        walls = None if region is None else region.steeper(view, to_si(steep, "deg"))
        if walls is not None and len(walls.faces) and getattr(table, "steep_deg", steep) is None:
            words, changes = WATERLINES, Changes(toolpath={"steep_deg": steep})
            if self.job.axis.mode == "normal" and isinstance(self._tool, BallEnded):
                # Normals all around are too much for most machines; an axis that is chosen may be the normal.
                words, changes = f"{CHOSEN}, {words}", changes | chosen_axis(self.job)
            yield self._estimated(words, changes)
        key = "stepover_mm" if getattr(table, "stepover_mm", None) is not None else "scallop_mm"
        if getattr(table, key, None) is None:
            return
        bound: dict[str, Any] = {}
        if self.job.tolerance.left_mm is None:
            bound = {"tolerance": {"left_mm": _shorter(float(from_si(self._coverage.left, "mm")))}}

        def nearer(share: float) -> Changes:
            # The height of a ridge grows with the square of the distance between passes.
            by = share if key == "stepover_mm" else share**2
            return merged({"toolpath": {key: _shorter(by * getattr(table, key))}}, bound)

        # A run goes back for passes that are nearer together by itself, and it was not enough.
        tried = min(NEARER) if may_come_nearer(self.job, self.failed[_LEFT]) else 1.0
        shares = [each for each in self.options.nearer if each < tried]
        for share in shares:
            yield (trial := self._estimated("passes nearer together", nearer(share)))
            # Where passes clear a share c of the area they clear c / share of it when they are nearer together. So the
            # nearest passes can clear all of it only where c is at least their own share.
            least = (1.0 - min(shares) / share) / (1.0 - min(shares))
            if trial[2] > least * self._left({}, self.toolpath):
                break
        if isinstance(self._tool, BallEnded):
            share = self.options.thinner
            diameter = _shorter(share * self.job.tool.diameter_mm)
            yield self._estimated("a smaller cutter", merged(nearer(share), {"tool": {"diameter_mm": diameter}}))

    def _estimated(self, words: str, changes: Changes) -> tuple[str, Changes, float]:
        """Return a trial's words and changes, and about the share of the region on which it leaves too much."""
        self.tell(words)
        return words, changes, self._left(changes)

    @cached_property
    def _coverage(self) -> Coverage:
        return job_coverage(self.job, self.mesh, self.machine)

    @cached_property
    def _unreached(self) -> float:
        """Share of the region that the ball leaves, but that the verdict does not count."""
        found = self.failed[_LEFT].value or 0.0
        return max(self._uncovered(self._coverage, self.job, self.toolpath) - 0.01 * found, 0.0)

    @cached_property
    def _most(self) -> float:
        """Share of the region up to which a change is planned: what may be left, and what chance may add to it.

        What the verdict does not count is estimated by points of the region, for the change as for the job.
        """
        deviation = np.sqrt(2.0 * self._unreached / self.options.surface_points)
        return self.options.surely * float(self.job.tolerance.left_share) + self.options.deviations * float(deviation)

    def _left(self, changes: Changes, toolpath: Toolpath | None = None) -> float:
        """Return about the share of the region on which a job with changes leaves too much.

        0 for a tool without a ball, 1 where no toolpath can be made. toolpath: one that is nearly that of the changes.
        """
        if not isinstance(self._tool, BallEnded):
            return 0.0
        toolpath = toolpath or _toolpath_of(self.job, changes, self.machine, self.mesh)
        if toolpath is None:
            return 1.0
        other = self.job.with_(**changes)
        coverage = job_coverage(other, self.mesh, self.machine)
        return self._uncovered(coverage, other, toolpath) - self._unreached

    def _uncovered(self, coverage: Coverage, job: Job, toolpath: Toolpath) -> float:
        """Return the share of points of a region above which a ball never is at the height that may be left."""
        tool = job_tool(job, self.machine)
        if coverage.region is None or not isinstance(tool, BallEnded) or not len(coverage.region.faces):
            return 0.0
        points, normals = coverage.region.spread(self.options.surface_points)
        above = points + coverage.left * normals
        return float(np.mean(uncovered(above, toolpath.tilt_centres, tool.radius, self.options.near_share)))


def _toolpath_of(job: Job, changes: Changes, machine: Machine, mesh: Mesh) -> Toolpath | None:
    """Return the toolpath of a job with changes; None where it has none."""
    try:
        return job_toolpath(job.with_(**changes), mesh, machine=machine)[0]
    except InputError:
        return None


def _cut_length(toolpath: Toolpath) -> float:
    """Return the length of the cuts of a toolpath, metres."""
    steps = np.linalg.norm(np.diff(toolpath.tilt_centres, axis=0), axis=1)
    kinds = np.array([toolpath.segments[k].kind is SegmentKind.CUT for k in toolpath.segment_of_interval])
    return float(steps[kinds].sum())


def staying(share: float) -> Trial:
    """Return the change by which a share of the region may stay as it is."""
    words = f"at most {100.0 * share:.3g} % of the region stays as it is"
    return Trial(words, {"tolerance": {"left_share": share}}, 1.0 - share, 1.0 - share)


def longer(share: float) -> float:
    """Return a share with two digits, rounded up."""
    size = 10.0 ** (np.floor(np.log10(max(share, 1e-6))) - 1.0)
    return float(f"{np.ceil(share / size) * size:.2g}")


def _shorter(length: float) -> float:
    """Return a length in mm with three digits."""
    return float(f"{length:.3g}")
