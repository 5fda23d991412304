"""Surface of the part itself: lines are contacts of the cutter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import normalised
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.heightfield import HeightField
from pentapod.mesh.region import Region
from pentapod.toolpath.lines.scallop import surface_steps
from pentapod.toolpath.options import CoverOptions, PathOptions
from pentapod.toolpath.surface import Contacts
from pentapod.toolpath.surfaces.stay_down_links import stay_down_links


@dataclass(frozen=True, eq=False)
class PartSurface:
    """The part's own surface, for a tool that touches it or stands off from it. view (3,): unit, towards the tool."""

    part: Mesh
    tool: Tool
    view: Floats
    radius = 0.0
    slides = False
    turns = True

    @property
    def mesh(self) -> Mesh:
        """The part."""
        return self.part

    @cached_property
    def field(self) -> HeightField:
        """Ray casting along the view."""
        return HeightField(self.part, self.view)

    @property
    def part_field(self) -> HeightField:
        """The same."""
        return self.field

    def hides(self, points: Floats, slack: float) -> Bools:
        """Return whether the part lies above points (N, 3) by more than `slack` metres."""
        return self.field.hides(points, slack)

    def patch(self, region: Region) -> Patch:
        """Return the region, cut exactly at its edges; empty where there is none."""
        return Patch.of(self.part, region)

    def steps(self, patch: Patch, across: Floats, options: CoverOptions) -> Floats:
        """Return the stepover (F,) on each facet of a patch, metres. Raises ToolpathError as `surface_steps`."""
        return surface_steps(patch, self.tool.scallop_radius, across, options)

    def waypoints(self, passes: Passes, options: PathOptions) -> Passes:
        """Return the passes with unit normals."""
        del options
        return replace(passes, normals=normalised(passes.normals))

    def links(
        self, ends: dict[int, tuple[Contacts, Contacts]], options: PathOptions, stepover: float
    ) -> dict[int, Contacts]:
        """Return `stay_down_links` between pairs of passes."""
        return stay_down_links(self.field, options, stepover, ends)

    def is_clear(self, centres: Floats, chordal: float) -> bool:
        """Return True: the collision check decides."""
        del centres, chordal
        return True

    def tight(self, passes: Passes) -> int:
        """Return how many steps of passes have a concave radius below the ball's radius or the stand-off."""
        closing = -(np.diff(passes.points, axis=0) * np.diff(passes.normals, axis=0)).sum(axis=1)
        return int((passes.within & (closing * abs(self.tool.tilt_centre) > passes.steps**2)).sum())
