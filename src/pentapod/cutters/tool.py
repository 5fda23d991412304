"""Tool: position of the tip at a contact with the surface, and the solids of its body.

Every tool is a body of revolution about its axis. The tip is the point of the axis at the lower end of the tool;
heights are measured from there along the axis, towards the spindle. Shank and holder are cones and cylinders, stacked
on the cutting part.
"""

from __future__ import annotations

from typing import Protocol

from pentapod.base.arrays import Floats
from pentapod.geometry.solids import Solid


class Tool(Protocol):
    """A cutter, beam or spray with shank and holder. `tilt_centre` is as in `Toolpath`."""

    @property
    def tilt_centre(self) -> float:
        """Distance in metres from the tip along the axis to the point about which the tool may tilt."""
        ...

    @property
    def can_tilt(self) -> bool:
        """Whether the contact stays where it is when the tool tilts about its tilt centre."""
        ...

    @property
    def scallop_radius(self) -> float | None:
        """Radius in metres of the rounding that leaves scallops between passes; None if there is none."""
        ...

    @property
    def solids(self) -> tuple[Solid, ...]:
        """The convex bodies that make up cutter, shank and holder."""
        ...

    def tips(self, contacts: Floats, normals: Floats, axes: Floats) -> Floats:
        """Return the tips (N, 3) at contacts (N, 3) with unit normals (N, 3) and unit axes (N, 3); metres."""
        ...
