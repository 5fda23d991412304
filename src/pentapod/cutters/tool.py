"""Tool: where the tip is when the tool touches the surface, and the solids of its body.

Every tool is a body of revolution about its axis. The tip is where the axis leaves the tool; heights are
measured from there along the axis, towards the spindle. Shank and holder are cones and cylinders, stacked
from the upper end of what cuts.
"""

from __future__ import annotations

from typing import Protocol

from pentapod.base.arrays import Floats
from pentapod.geometry.solids import Solid


class Tool(Protocol):
    """What meets the surface. `tilt_centre` is as in `Toolpath`."""

    @property
    def tilt_centre(self) -> float:
        """Distance in metres from the tip along the axis to the point about which the tool may tilt."""
        ...

    @property
    def leans(self) -> bool:
        """Whether the tool may tilt about its tilt centre and still meet the surface where it did."""
        ...

    @property
    def scallop_radius(self) -> float | None:
        """Radius in metres of the rounding that leaves ridges between passes; None where none is defined."""
        ...

    @property
    def solids(self) -> tuple[Solid, ...]:
        """The convex bodies that make up cutter, shank and holder."""
        ...

    def tips(self, contacts: Floats, normals: Floats, axes: Floats) -> Floats:
        """Return the tips (N, 3) of a tool with axes (N, 3) that meets contacts (N, 3); normals are unit."""
        ...
