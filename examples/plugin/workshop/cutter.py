"""A cutter: a pointed cone that engraves with its tip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pentapod import Cone
from pentapod.base.arrays import Floats
from pentapod.base.keys import Key
from pentapod.cutters.mounted import Mounted, check_positive
from pentapod.geometry.solids import Solid, stacked


@dataclass(frozen=True)
class Engraver(Mounted):
    """radius: of the cone's upper end; height: of the cone; metres. In a job file `diameter_mm` and `height_mm`."""

    radius: Annotated[float, Key("mm", "of the cone's upper end", name="diameter", share=0.5, gt=0.0, le=50.0)]
    height: Annotated[float, Key("mm", "of the cone", gt=0.0, le=100.0)] = 0.01

    tilt_centre = 0.0
    can_tilt = False
    scallop_radius = None

    def __post_init__(self) -> None:
        check_positive("radius", self.radius)
        check_positive("height", self.height)

    def tips(self, contacts: Floats, normals: Floats, axes: Floats) -> Floats:
        """Return the contacts: the tip meets the surface."""
        del normals, axes
        return contacts

    def _cutter(self) -> tuple[Solid, ...]:
        return stacked("cutter", (Cone(self.height, 0.0, self.radius),), 0.0)
