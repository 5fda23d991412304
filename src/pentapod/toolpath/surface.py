"""Surface: what a strategy draws its lines on, and how these become contacts of the cutter and links between passes."""

from __future__ import annotations

from typing import Protocol

from pentapod.base.arrays import Bools, Floats
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.heightfield import HeightField
from pentapod.mesh.region import Region
from pentapod.toolpath.options import CoverOptions, PathOptions

Contacts = tuple[Floats, Floats]
"""Contacts (n, 3), metres, and unit normals (n, 3) of a pass or link."""


class Surface(Protocol):
    """The part itself (`PartSurface`), or where a ball's centre is that rolls over it (`DriveSurface`)."""

    @property
    def part(self) -> Mesh:
        """The part."""
        ...

    @property
    def part_field(self) -> HeightField:
        """Ray casting onto the part along the view."""
        ...

    @property
    def mesh(self) -> Mesh:
        """The mesh on which lines are drawn."""
        ...

    @property
    def radius(self) -> float:
        """Radius in metres of the ball that rolls; 0 on the part itself."""
        ...

    @property
    def slides(self) -> bool:
        """Whether links on the surface are proven clear, and so may be of any length."""
        ...

    @property
    def turns(self) -> bool:
        """Whether the tool's axis may turn with the normals of its lines; not where it is fixed."""
        ...

    def hides(self, points: Floats, slack: float) -> Bools:
        """Return whether `mesh` lies above points (N, 3) on it, along the view, by more than `slack` metres."""
        ...

    def patch(self, region: Region) -> Patch:
        """Return the part of `mesh` from which a region is machined; empty where there is none."""
        ...

    def steps(self, patch: Patch, across: Floats, options: CoverOptions) -> Floats:
        """Return the stepover (F,) on each facet of a patch, metres. across (F, 3) or (3,): directions across passes.

        Raises ToolpathError for a scallop that does not suit the tool.
        """
        ...

    def waypoints(self, passes: Passes, options: PathOptions) -> Passes:
        """Return contacts with unit normals from resampled lines on `mesh`."""
        ...

    def links(
        self, ends: dict[int, tuple[Contacts, Contacts]], options: PathOptions, stepover: float
    ) -> dict[int, Contacts]:
        """Return the links on the surface between pairs of passes, ends included, where there is one."""
        ...

    def is_clear(self, centres: Floats, chordal: float) -> bool:
        """Return whether the ball is clear of the part but for `chordal` metres along a line of centres (n, 3).

        True on the part itself, where nothing is known of it.
        """
        ...

    def tight(self, passes: Passes) -> int:
        """Return how many steps of passes (contacts) have a concave radius below the ball's radius or the stand-off."""
        ...
