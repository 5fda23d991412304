"""Linking of ordered passes by the shortest links that are free of collision."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import angle_between
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.swept_depth import is_clear
from pentapod.mesh.query.tree import FacetTree
from pentapod.toolpath.linking import links
from pentapod.toolpath.linking.links import LinkStyle, Pose
from pentapod.toolpath.options import Entry, PathOptions
from pentapod.toolpath.surface import Surface
from pentapod.toolpath.toolpath import Segment, SegmentKind, Toolpath


@dataclass(frozen=True)
class LinkingOptions:
    """How links are chosen. touch, same_tip: metres.

    touch: passes that meet within this distance, and radian, need no link. same_tip: tips within this distance are made
    equal. straight: up to this gap a link is straight, as a share of the spacing. margin: gap to the part on rapids, as
    a share of the approach height. hops: heights of hops that are tried, as shares of the clearance.
    """

    touch: float = 1e-9
    same_tip: float = 1e-7
    straight: float = 0.1
    margin: float = 0.2
    hops: tuple[float, ...] = (0.0, 0.5, 1.0)


@dataclass(frozen=True, eq=False)
class Run:
    """One pass in the order of work.

    contacts, normals (n, 3): metres and unit. power: share of full power. stay: largest distance from the previous
    pass, metres, for a link on the surface.
    """

    contacts: Floats
    normals: Floats
    power: float
    stay: float


class CollisionCheck:
    """Collision check of tool, shank and holder against a part. view (3,): unit, towards the tool."""

    def __init__(self, mesh: Mesh, tool: Tool, view: Floats) -> None:
        self.mesh, self.tool, self.view = mesh, tool, view
        self._top = float((mesh.vertices @ view).max())
        # No point of the tool is further from its tip than this.
        self._reach = max((s.top + s.low_radius + s.high_radius for s in tool.solids), default=0.0)

    @cached_property
    def _tree(self) -> FacetTree:
        return FacetTree.of(self.mesh)

    def is_clear(self, segment: Segment, margin: float) -> bool:
        """Return whether the tool keeps a distance of `margin` metres from the part during the whole motion."""
        if not self.tool.solids or (segment.tips @ self.view).min() > self._top + self._reach + margin:
            return True
        return is_clear(self._tree, self.tool, segment.tips, segment.axes, threshold=-margin)


class Linker:
    """Links between passes in their order of work.

    A pass that begins where the previous one ends follows without a link; one within `stay` is reached over the
    surface if the limits of the surface allow; one within `hop` by a rapid just above the part; others at
    the clearance height. `toolpath` counts how many passes are reached on the surface (stay_downs) and by a hop (hops).
    """

    def __init__(
        self,
        surface: Surface,
        tool: Tool,
        options: PathOptions,
        *,
        runs: list[Run],
        stepover: float,
        choice: LinkingOptions = LinkingOptions(),
    ) -> None:
        self.surface, self.tool, self.options, self.runs, self.choice = surface, tool, options, runs, choice
        self.stay_downs = self.hops = 0
        self.tips = [tool.tips(run.contacts, run.normals, run.normals) for run in runs]
        view = options.up
        highest = max(float((tips @ view).max()) for tips in self.tips)
        top = max(float((surface.part.vertices @ view).max()) + max(-tool.tilt_centre, 0.0), highest)
        # The corner of a rapid is two approaches off the surface, and must not be above the level.
        level = top + max(options.clearance, 2.0 * options.approach)
        self.style = LinkStyle(
            view,
            level,
            options.approach,
            options.spacing,
            options.link_feed,
            Entry(options.entry),
            min(options.axis_step, LinkStyle.axis_step),
        )
        self.collision = CollisionCheck(surface.part, tool, view)
        self.margin = choice.margin * options.approach
        near = [
            k
            for k in range(1, len(runs))
            if np.linalg.norm(runs[k].contacts[0] - runs[k - 1].contacts[-1]) <= runs[k].stay
            and (surface.slides or not self._is_straight(*self._gap(k)))
        ]
        contacts = [(run.contacts, run.normals) for run in runs]
        self.links_on_surface = surface.links({k: (contacts[k - 1], contacts[k]) for k in near}, options, stepover)

    def toolpath(self) -> Toolpath:
        """Return the passes with their links. It begins and ends at the clearance level."""
        segments: list[Segment] = []
        for k, run in enumerate(self.runs):
            segments += self._links_to(k)
            segments.append(Segment(SegmentKind.CUT, self.tips[k], run.normals, self.options.feed, run.power))
        up, start = self._lead(links.retract, len(self.runs) - 1)
        return Toolpath((*segments, up, links.rapid(start, None, self.style)), self.tool.tilt_centre)

    def _links_to(self, k: int) -> list[Segment]:
        """Return the segments from the end of the previous run to the beginning of run k."""
        if k > 0:
            direct = self._direct(k)
            if direct is not None:
                self.stay_downs += 1
                return direct
        down, end = self._lead(links.approach, k)
        if k == 0:
            return [links.rapid(None, end, self.style), down]
        up, start = self._lead(links.retract, k - 1)
        if np.linalg.norm(self.tips[k][0] - self.tips[k - 1][-1]) <= self.options.hop:
            hop = self._hop(start, end)
            if hop is not None:
                self.hops += 1
                return [up, hop, down]
        return [up, links.rapid(start, end, self.style), down]

    def _direct(self, k: int) -> list[Segment] | None:
        """Return the segments on the surface from the previous run to run k; None where the tool must retract."""
        before, after = self.runs[k - 1], self.runs[k]
        gap, turn = self._gap(k)
        if gap < self.choice.touch and turn < self.choice.touch:
            return []
        if k in self.links_on_surface:
            contacts, axes = self.links_on_surface[k]
            tips = self.tool.tips(contacts, axes, axes)
        elif self._is_straight(gap, turn):
            # A retract and approach would be a needle; where the passes meet, the tool turns on the spot.
            if gap < self.choice.same_tip:
                self.tips[k][0] = self.tips[k - 1][-1]
            tips = np.stack([self.tips[k - 1][-1], self.tips[k][0]])
            axes = np.stack([before.normals[-1], after.normals[0]])
        else:
            return None
        return [Segment(SegmentKind.LINK, tips, axes, self.options.link_feed)]

    def _gap(self, k: int) -> tuple[float, float]:
        """Return the distance of tips and the angle of axes from the previous run's end to run k."""
        before, after = self.runs[k - 1], self.runs[k]
        turn = float(angle_between(after.normals[0], before.normals[-1]))
        return float(np.linalg.norm(self.tips[k][0] - self.tips[k - 1][-1])), turn

    def _is_straight(self, gap: float, turn: float) -> bool:
        """Return whether a link is so short that it is straight."""
        return gap <= self.choice.straight * self.options.spacing and turn <= self.options.axis_step

    def _lead(self, lead: Callable[..., Segment], k: int) -> tuple[Segment, Pose]:
        """Return the approach or retract of run k, and the pose at its upper end.

        It is along the axis if a ramp or arc would collide; if that would, too, along the view, or between them.
        """
        tips, axes, row = self.tips[k], self.runs[k].normals, 0 if lead is links.approach else -1
        axis = axes[row]
        if self.style.entry is not Entry.AXIS:
            link = lead(tips, axes, self.style)
            if self.collision.is_clear(link, 0.0):
                return link, (link.tips[row], axis, axis)
        style = replace(self.style, entry=Entry.AXIS)
        between = axis + style.view
        ways = [axis, style.view, between / max(float(np.linalg.norm(between)), 1e-9)]
        leave = next((way for way in ways if self._leaves(tips[row], axis, way)), axis)
        link = lead(tips, axes, style, leave)
        return link, (link.tips[row], axis, leave)

    def _leaves(self, tip: Floats, axis: Floats, leave: Floats) -> bool:
        """Return whether the tool's tilt centre is clear on the way from a tip to the clearance level."""
        corners = np.stack([tip, *links.rise(tip + self.style.approach * leave, leave, self.style)])
        return self.surface.is_clear(corners + self.tool.tilt_centre * axis, self.options.chordal)

    def _hop(self, start: Pose, end: Pose) -> Segment | None:
        """Return the lowest rapid just above the part that is proven clear; None if there is none."""
        base = max(float((tip + self.style.approach * leave) @ self.style.view) for tip, _, leave in (start, end))
        for rise in self.choice.hops:
            level = base + rise * self.options.clearance
            if level >= self.style.level:
                break
            hop = links.rapid(start, end, replace(self.style, level=level))
            if self.collision.is_clear(hop, self.margin):
                return hop
        return None
