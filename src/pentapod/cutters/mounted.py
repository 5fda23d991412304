"""Shank, holder and stem, which all tools have, and cutters with a ball end."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from typing import Annotated, ClassVar, Self

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key
from pentapod.base.values import Value
from pentapod.geometry.solids import Cone, Solid, stacked


@dataclass(frozen=True, kw_only=True)
class Mounted(Value, ABC):
    """A tool with shank and holder: stacked cones above the cutting part, towards the spindle.

    reserve: by how much shank and holder count as larger all around, metres.
    stem: height above the tip, metres, up to which a shank of the cutter's diameter reaches; None for no such shank.
    largest_lean: the largest angle of the axis from the surface's normal that suits the tool, radians; 0 for tools that
    cannot tilt.
    """

    largest_lean: ClassVar[float] = 0.0

    shank: tuple[Cone, ...] = field(default=())
    holder: tuple[Cone, ...] = field(default=())
    stem: float | None = None
    reserve: float = 0.0

    @property
    def solids(self) -> tuple[Solid, ...]:
        """The convex bodies that make up cutter, shank and holder."""
        cutter = self._cutter()
        base = cutter[-1].top if cutter else 0.0
        shank = stacked("shank", self.shank, base)
        if self.stem is not None and cutter:
            wide = max(solid.largest_radius for solid in cutter if solid.kind == "cutter")
            shank = (Solid("shank", cutter[-1].high, self.stem, wide, wide), *shank)
        holder = stacked("holder", self.holder, max([base, *(s.high for s in shank)]))
        larger = (replace(solid, rounding=solid.rounding + self.reserve) for solid in (*shank, *holder))
        return (*cutter, *larger)

    def with_stem(self, top: float) -> Self:
        """Return the tool with a shank of the cutter's diameter up to `top`, metres above the tip.

        A tool with a shank or holder of its own, without a cutter, or as long as that, is returned as it is.
        """
        cutter = self._cutter()
        if self.shank or self.holder or not cutter or cutter[-1].high >= top:
            return self
        return replace(self, stem=top)

    @abstractmethod
    def _cutter(self) -> tuple[Solid, ...]:
        """Return the bodies below shank and holder, upwards; the shank begins at the top of the last."""


@dataclass(frozen=True)
class BallEnded(Mounted):
    """A cutter with a ball end. radius: of the ball, metres. It may lean until its contact is on the ball's equator."""

    largest_lean: ClassVar[float] = float(np.radians(90.0))

    radius: Annotated[
        float, Key("mm", "diameter of the cutter, or of its ball", name="diameter", share=0.5, gt=0.0, le=100.0)
    ]

    @property
    def tilt_centre(self) -> float:
        """The ball's centre, a radius above the tip."""
        return self.radius

    @property
    def can_tilt(self) -> bool:
        """True: about the ball's centre."""
        return True

    @property
    def scallop_radius(self) -> float:
        """The ball's radius."""
        return self.radius

    def tips(self, contacts: Floats, normals: Floats, axes: Floats) -> Floats:
        """Return the tips: the ball's centre lies a radius above the contact along the normal."""
        return contacts + self.radius * (normals - axes)


Flute = Annotated[float | None, Key("mm", "cutting length from the tip; above it the shank begins", gt=0.0, le=500.0)]
"""Cutting length, metres; None for the rounded end alone."""


def rounded_end(radius: float, corner: float, flute: float | None) -> tuple[Solid, ...]:
    """Return the body of an end rounded with `corner`, and of the flute above it."""
    end = Solid("cutter", corner, corner, radius - corner, radius - corner, corner)
    return (end,) if flute is None else (end, Solid("cutter", corner, flute, radius, radius))


def check_flute(flute: float | None, least: float) -> None:
    """Raise ToolpathError unless a cutting length is None or more than `least` metres."""
    if flute is not None and not least < flute < np.inf:
        raise size_error("flute", flute, f"more than {least} m")


def check_positive(key: str, value: float) -> None:
    """Raise ToolpathError unless a length is positive and finite."""
    if not (np.isfinite(value) and value > 0.0):
        raise size_error(key, value, "> 0")


def size_error(key: str, value: float, expected: str) -> ToolpathError:
    """Return the error of a size that no tool can have."""
    return ToolpathError("impossible tool", key=key, value=value, expected=expected)
