"""Linking of ordered passes, each link the shortest that is proven free of collision."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import angle_between
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.passes import Passes
from pentapod.mesh.query.heightfield import HeightField
from pentapod.toolpath.linking import links
from pentapod.toolpath.linking.clearing import Clearing
from pentapod.toolpath.linking.resampling import resample
from pentapod.toolpath.linking.stay_down import surface_links
from pentapod.toolpath.options import Entry, PathOptions
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath

_TOUCH_M = 1e-9
_TINY_M = 1e-7
_STRAIGHT_SPACINGS = 0.1


@dataclass(frozen=True, eq=False)
class Run:
    """One pass in the order of work.

    contacts, normals (n, 3): metres and unit. power: share of full power. stay: metres from the pass before up
    to which a link to it may stay on the surface.
    """

    contacts: Floats
    normals: Floats
    power: float
    stay: float


@dataclass
class Counts:
    """How passes are reached: on the surface, by a hop; and rapids for which no clear way was found."""

    stay_downs: int = 0
    hops: int = 0
    unproven: int = 0


def linked(
    mesh: Mesh, tool: Tool, options: PathOptions, *, runs: list[Run], field: HeightField, stepover: float
) -> tuple[Toolpath, Counts]:
    """Return runs in their order with the links between them, and how many of which kind.

    A pass that begins where the last one ends follows without a link; one closer than its `stay` over the surface,
    where the surface allows; one closer than `hop` by a rapid close above the part; else over the
    clearance level. Rapids are proven clear of the part, as far as a way is found.
    """
    return _Linker(mesh, tool, options, runs, field, stepover).toolpath()


class _Linker:
    def __init__(
        self, mesh: Mesh, tool: Tool, options: PathOptions, runs: list[Run], field: HeightField, stepover: float
    ) -> None:
        self.tool, self.options, self.runs, self.field = tool, options, runs, field
        self.tips = [tool.tips(run.contacts, run.normals, run.normals) for run in runs]
        self.counts = Counts()
        view = options.up
        highest = max(float((tips @ view).max()) for tips in self.tips)
        top = max(float((mesh.vertices @ view).max()) + max(-tool.tilt_centre, 0.0), highest)
        # A rapid's knee is two approaches off the surface; no knee may reach above the level.
        level = top + max(options.clearance, 2.0 * options.approach)
        self.style = links.LinkStyle(
            view,
            level,
            options.approach,
            options.spacing,
            options.link_feed,
            Entry(options.entry),
            min(options.axis_step, links.RAPID_AXIS_STEP),
        )
        self.clearing = Clearing(mesh, tool, view)
        self.margin = 0.2 * options.approach
        self.down = self._surface_links(stepover)

    def toolpath(self) -> tuple[Toolpath, Counts]:
        segments: list[Segment] = []
        for k, run in enumerate(self.runs):
            segments += self._way_to(k)
            segments.append(Segment(SegmentKind.CUT, self.tips[k], run.normals, self.options.feed, run.power))
        away = self._retract(len(self.runs) - 1)
        segments.append(away)
        segments.append(self._proven(links.leave(away.tips[-1], away.axes[-1], self.style)))
        return Toolpath(tuple(segments), self.tool.tilt_centre), self.counts

    def _way_to(self, k: int) -> list[Segment]:
        """Return the segments from the end of the run before to the start of run k."""
        down = self._approach(k)
        if k == 0:
            return [self._proven(links.entry(down.tips[0], down.axes[0], self.style)), down]
        gap = float(np.linalg.norm(self.tips[k][0] - self.tips[k - 1][-1]))
        turn = float(angle_between(self.runs[k].normals[0], self.runs[k - 1].normals[-1]))
        if gap < _TOUCH_M and turn < _TOUCH_M:
            self.counts.stay_downs += 1
            return []
        if gap <= _STRAIGHT_SPACINGS * self.options.spacing and turn <= self.options.axis_step:
            # So near that going up and down again would be a needle; where they meet, the tool turns on the spot.
            self.counts.stay_downs += 1
            if gap < _TINY_M:
                self.tips[k][0] = self.tips[k - 1][-1]
            tips = np.stack([self.tips[k - 1][-1], self.tips[k][0]])
            axes = np.stack([self.runs[k - 1].normals[-1], self.runs[k].normals[0]])
            return [Segment(SegmentKind.LINK, tips, axes, self.options.link_feed)]
        link = self.down.get(k)
        if link is not None:
            self.counts.stay_downs += 1
            tips = self.tool.tips(link[0], link[1], link[1])
            return [Segment(SegmentKind.LINK, tips, link[1], self.options.link_feed)]
        up = self._retract(k - 1)
        ends = (up.tips[-1], up.axes[-1], down.tips[0], down.axes[0])
        if gap <= self.options.hop:
            hop = self._hop(*ends)
            if hop is not None:
                self.counts.hops += 1
                return [up, hop, down]
        return [up, self._proven(links.rapid(*ends, self.style)), down]

    def _approach(self, k: int) -> Segment:
        tips, axes = self.tips[k], self.runs[k].normals
        down = links.approach(tips[0], axes[0], tips[1] - tips[0], self.style)
        if self.style.entry is Entry.AXIS or self._clear(down, 0.0):
            return down
        return links.approach(tips[0], axes[0], tips[1] - tips[0], replace(self.style, entry=Entry.AXIS))

    def _retract(self, k: int) -> Segment:
        tips, axes = self.tips[k], self.runs[k].normals
        up = links.retract(tips[-1], axes[-1], tips[-1] - tips[-2], self.style)
        if self.style.entry is Entry.AXIS or self._clear(up, 0.0):
            return up
        return links.retract(tips[-1], axes[-1], tips[-1] - tips[-2], replace(self.style, entry=Entry.AXIS))

    def _hop(self, start: Floats, start_axis: Floats, end: Floats, end_axis: Floats) -> Segment | None:
        """Return a rapid that crosses close above the part, the lowest of a few that is proven clear; or None."""
        view = self.options.up
        base = max(
            float((start + self.style.approach * start_axis) @ view),
            float((end + self.style.approach * end_axis) @ view),
        )
        for rise in (0.0, 0.5, 1.0):
            level = base + rise * self.options.clearance
            if level >= self.style.level:
                break
            hop = links.rapid(start, start_axis, end, end_axis, replace(self.style, level=level))
            if self._clear(hop, self.margin):
                return hop
        return None

    def _proven(self, rapid: Segment) -> Segment:
        if not self._clear(rapid, self.margin):
            self.counts.unproven += 1
        return rapid

    def _clear(self, segment: Segment, margin: float) -> bool:
        return self.clearing.clear(segment.tips, segment.axes, margin)

    def _surface_links(self, stepover: float) -> dict[int, tuple[Floats, Floats]]:
        """Return by run the contacts and normals of links to it that stay on the surface."""
        near = [
            k
            for k in range(1, len(self.runs))
            if np.linalg.norm(self.runs[k].contacts[0] - self.runs[k - 1].contacts[-1]) <= self.runs[k].stay
        ]
        ends = [
            (self.runs[k - 1].contacts, self.runs[k - 1].normals, self.runs[k].contacts, self.runs[k].normals)
            for k in near
        ]
        found = surface_links(self.field, self.options, stepover, ends)
        good = [(k, link) for k, link in zip(near, found, strict=True) if link is not None]
        if not good:
            return {}
        fine = resample(
            Passes.of([link for _, link in good]),
            chordal=self.options.chordal,
            spacing=self.options.spacing,
            axis_step=self.options.axis_step,
            closest=min([self.options.closest, *(0.25 * float(np.linalg.norm(c[-1] - c[0])) for _, (c, _) in good)]),
        )
        result: dict[int, tuple[Floats, Floats]] = {}
        for place, level in enumerate(fine.levels):
            rows = fine.rows(place)
            normals = fine.normals[rows] / np.linalg.norm(fine.normals[rows], axis=1, keepdims=True)
            contacts = fine.points[rows].copy()
            run = good[int(level)][0]
            # The ends are exactly those of the passes.
            contacts[0], contacts[-1] = self.runs[run - 1].contacts[-1], self.runs[run].contacts[0]
            normals[0], normals[-1] = self.runs[run - 1].normals[-1], self.runs[run].normals[0]
            result[run] = contacts, normals
        return result
