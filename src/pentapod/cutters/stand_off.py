"""StandOff: a tool at a constant distance from the surface, such as a laser, spray or water jet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key
from pentapod.cutters.mounted import Mounted
from pentapod.geometry.solids import Solid


@dataclass(frozen=True)
class StandOff(Mounted):
    """A laser, spray or water jet. distance: stand-off from the tip to the surface along the axis, metres, ≥ 0.

    The shank, from the tip on, is the nozzle. It may lean a little only: the spot grows with the angle. Raises
    ToolpathError for a negative distance.

    >>> StandOff(5e-3).tilt_centre
    -0.005
    """

    largest_lean: ClassVar[float] = float(np.radians(15.0))

    distance: Annotated[float, Key("mm", "from the tip to the surface", name="standoff", gt=0.0, le=200.0)]

    def __post_init__(self) -> None:
        if not (np.isfinite(self.distance) and self.distance >= 0.0):
            raise ToolpathError("the stand-off must not be negative", key="distance", value=self.distance)

    @property
    def tilt_centre(self) -> float:
        """The spot on the surface, the stand-off below the tip."""
        return -self.distance

    @property
    def can_tilt(self) -> bool:
        """True: about the spot on the surface."""
        return True

    @property
    def scallop_radius(self) -> None:
        """None: a beam or spray leaves no scallop."""
        return

    def tips(self, contacts: Floats, normals: Floats, axes: Floats) -> Floats:
        """Return the tips: the stand-off away from the contact along the axis."""
        del normals
        return contacts + self.distance * axes

    def _cutter(self) -> tuple[Solid, ...]:
        return ()


CUTTER = StandOff
