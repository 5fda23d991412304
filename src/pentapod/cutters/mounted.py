"""Shank and holder, which all tools share, and the tools with a ball at the lower end."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key
from pentapod.base.values import Value
from pentapod.geometry.solids import Cone, Solid, stacked


@dataclass(frozen=True, kw_only=True)
class Mounted(Value, ABC):
    """shank, holder: what follows on the cutting part, from the tip towards the spindle; heights in metres."""

    shank: tuple[Cone, ...] = field(default=())
    holder: tuple[Cone, ...] = field(default=())

    @property
    def solids(self) -> tuple[Solid, ...]:
        """The convex bodies that make up cutter, shank and holder."""
        base = self._base()
        shank = stacked("shank", self.shank, base)
        holder = stacked("holder", self.holder, max([base, *(s.high for s in shank)]))
        return (*self._cutter(), *shank, *holder)

    @abstractmethod
    def _cutter(self) -> tuple[Solid, ...]:
        """Return the bodies below shank and holder."""

    def _base(self) -> float:
        """Return the height at which the shank begins: on top of what cuts."""
        return max((solid.top for solid in self._cutter()), default=0.0)


@dataclass(frozen=True)
class Balled(Mounted):
    """A ball at the lower end. radius: of the ball, metres."""

    radius: Annotated[
        float, Key("mm", "diameter of the cutter, or of its ball", name="diameter", share=0.5, gt=0.0, le=100.0)
    ]

    @property
    def tilt_centre(self) -> float:
        """The ball's centre, a radius above the tip."""
        return self.radius

    @property
    def leans(self) -> bool:
        """True: about the ball's centre."""
        return True

    @property
    def scallop_radius(self) -> float:
        """The ball's."""
        return self.radius

    def tips(self, contacts: Floats, normals: Floats, axes: Floats) -> Floats:
        """Return the tips: the ball's centre lies a radius above the contact along the normal."""
        return contacts + self.radius * (normals - axes)


def rounded_end(radius: float, corner: float, flute: float | None) -> tuple[Solid, ...]:
    """Return the body of an end rounded with `corner`, and of the flute above it."""
    end = Solid("cutter", corner, corner, radius - corner, radius - corner, corner)
    return (end,) if flute is None else (end, Solid("cutter", corner, flute, radius, radius))


def check_flute(flute: float | None, least: float) -> None:
    """Raise ToolpathError unless a cutting length, if there is one, is more than `least` metres."""
    if flute is not None and not least < flute < np.inf:
        raise wrong("flute", flute, f"more than {least} m")


def check_positive(key: str, value: float) -> None:
    """Raise ToolpathError unless a length is positive and finite."""
    if not (np.isfinite(value) and value > 0.0):
        raise wrong(key, value, "> 0")


def wrong(key: str, value: float, expected: str) -> ToolpathError:
    """Return the error of a size that no tool has."""
    return ToolpathError("impossible tool", key=key, value=value, expected=expected)
