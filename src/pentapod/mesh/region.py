"""Region: the part of a surface to machine, by a box and by the direction of its normals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import VECTOR, Key
from pentapod.base.values import Value
from pentapod.geometry.directions import normalised

WALL_SLACK = float(np.radians(0.5))
"""By how much a region of 90° reaches further, so that rounding does not split upright walls; radians."""
ON_PART = float(np.radians(80.0))
"""Angle of the normals, radians, up to which the part's own surface is machined if the region does not say."""


@dataclass(frozen=True, eq=False)
class Region(Value):
    """Surface points within a box whose normal is within an angle of a direction, all in the mesh's frame.

    direction (3,): any length. angle: radians in (0, π]; None for a right angle where a ball rolls over the part, and
    80° on the part itself. At π/2 upright walls belong to it, with `WALL_SLACK`; beyond it overhangs do, of which
    strategies leave out what the view does not see. box (2, 3): two opposite corners, metres, or None. Raises
    ToolpathError for a direction of no length, an angle out of range, or a flat box.

    >>> flat = Region(box=((-0.02, -0.02, 0.0), (0.02, 0.02, 0.05)), angle=np.radians(30))
    >>> passes = RasterOptions(region=flat, stepover=2e-3)
    """

    box: Annotated[
        Floats | tuple[tuple[float, float, float], tuple[float, float, float]] | None,
        Key(
            "mm", "machine only inside this box: two opposite corners, mesh frame, scaled",
            name="region_box", kind=tuple[VECTOR, VECTOR],
        ),
    ] = None  # fmt: skip
    direction: Annotated[
        Floats | tuple[float, float, float],
        Key("", "direction that the machined side faces, mesh frame", name="region_direction", kind=VECTOR),
    ] = (0.0, 0.0, 1.0)
    angle: Annotated[
        float | None,
        Key(
            "deg",
            "machine only where the normal is within this angle of it; 90 takes upright walls too. "
            "If left out: 90 where a ball covers the surface, else 80",
            name="region_angle",
            gt=0.0,
            le=180.0,
        ),
    ] = None

    def __post_init__(self) -> None:
        direction = frozen(self.direction, "region.direction", (3,))
        if not np.linalg.norm(direction) > 0.0:
            raise ToolpathError("the direction has no length", key="region.direction")
        set_frozen(self, direction=frozen(normalised(direction), "region.direction"))
        if self.angle is not None and not 0.0 < self.angle <= np.pi:
            raise ToolpathError("the angle is out of range", key="region.angle", value=self.angle, expected="(0, pi]")
        if self.box is not None:
            box = frozen(self.box, "region.box", (2, 3))
            if (box[0] == box[1]).any():
                raise ToolpathError("the box is flat", key="region.box", value=box.tolist())
            set_frozen(self, box=frozen(np.sort(box, axis=0), "region.box"))

    @property
    def within(self) -> float:
        """The angle on the part itself, radians."""
        return ON_PART if self.angle is None else self.angle

    @property
    def bounds(self) -> Floats:
        """Lowest and highest coordinates (2, 3), infinite without a box."""
        if self.box is None:
            return np.array([[-np.inf] * 3, [np.inf] * 3])
        return np.asarray(self.box)

    def faces(self, normals: Floats, default: float = ON_PART) -> Floats:
        """Return n·d − cos(angle)·‖n‖ (...) of normals (..., 3), of any length: not negative inside.

        default: the angle of a region that has none, radians.
        """
        right, angle = 0.5 * np.pi, default if self.angle is None else self.angle
        angle = max(angle, right + WALL_SLACK) if angle >= right else angle
        return normals @ self.direction - np.cos(angle) * np.linalg.norm(normals, axis=-1)
