"""BullNose: a flat-ended cutter with a rounded corner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.keys import Key
from pentapod.cutters.mounted import Flute, Mounted, check_flute, check_positive, rounded_end, size_error
from pentapod.geometry.solids import Solid

UPRIGHT = 1e-6
"""Sine of the angle between axis and normal below which the end lies flat on the surface."""


@dataclass(frozen=True)
class BullNose(Mounted):
    """A flat end with a rounded corner. radius: of the cutter; corner: of the rounding; flute: cutting length; metres.

    The contact is on the rounding, or under the tip where the axis is the normal. Raises ToolpathError unless
    0 ≤ corner < radius and the flute is longer than the corner.

    >>> BullNose(5e-3, corner=1e-3, flute=0.015).can_tilt
    False
    """

    radius: Annotated[float, Key("mm", "diameter of the cutter", name="diameter", share=0.5, gt=0.0, le=100.0)]
    corner: Annotated[float, Key("mm", "bull: radius of the rounded corner", gt=0.0, le=50.0)]
    flute: Flute = None

    def __post_init__(self) -> None:
        check_positive("radius", self.radius)
        if not 0.0 <= self.corner < self.radius:
            raise size_error("corner", self.corner, f"from 0 to below the cutter's radius, {self.radius} m")
        check_flute(self.flute, self.corner)

    @property
    def tilt_centre(self) -> float:
        """Zero: the tip."""
        return 0.0

    @property
    def can_tilt(self) -> bool:
        """False: tilting about any fixed point lifts the cutter off the surface or gouges."""
        return False

    @property
    def scallop_radius(self) -> float | None:
        """The corner's radius, the smallest with which the cutter cuts; None for a sharp corner."""
        return self.corner or None

    def tips(self, contacts: Floats, normals: Floats, axes: Floats) -> Floats:
        """Return the tips: the contact is the point of the rounding that is furthest against the normal."""
        flat = normals - np.einsum("...i,...i->...", normals, axes)[..., None] * axes
        sine = np.linalg.norm(flat, axis=-1, keepdims=True)
        outward = np.where(sine > UPRIGHT, flat / np.where(sine > UPRIGHT, sine, 1.0), 0.0)
        return contacts + self.corner * (normals - axes) + (self.radius - self.corner) * outward

    def _cutter(self) -> tuple[Solid, ...]:
        if self.corner == 0.0:
            return (Solid("cutter", 0.0, self.flute or self.radius, self.radius, self.radius),)
        return rounded_end(self.radius, self.corner, self.flute)


CUTTER = BullNose
