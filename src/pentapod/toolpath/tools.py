"""Tools as the workpiece sees them: where the tip is when the tool meets the surface, and what body it has.

Every tool is a body of revolution about its axis. The tip is where the axis leaves the tool; heights are
measured from there along the axis, towards the spindle. Shank and holder are cones and cylinders, stacked
from the upper end of what cuts.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from pentapod.arrays import Floats
from pentapod.errors import ToolpathError
from pentapod.toolpath.solids import Cone, Solid, stacked

_UPRIGHT = 1e-6
"""Sine of the angle between axis and normal below which a flat end counts as lying flat on the surface."""


class Tool(Protocol):
    """What meets the surface. `pivot` is as in `Toolpath`."""

    @property
    def pivot(self) -> float:
        """Distance in metres from the tip along the axis to the point about which the tool may tilt."""
        ...

    @property
    def leans(self) -> bool:
        """Whether the tool may tilt about its pivot and still meet the surface where it did."""
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


@dataclass(frozen=True, kw_only=True)
class _Mounted(ABC):
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
class _Balled(_Mounted):
    """A ball at the lower end. radius: of the ball, metres."""

    radius: float

    @property
    def pivot(self) -> float:
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


@dataclass(frozen=True)
class BallCutter(_Balled):
    """A ball-ended cutter. radius: of the ball; flute: cutting length from the tip, the ball alone if None.

    Metres. Raises ToolpathError unless the radius is positive and the flute at least as long.
    """

    flute: float | None = None

    def __post_init__(self) -> None:
        _positive("radius", self.radius)
        _flute(self.flute, self.radius)

    def _cutter(self) -> tuple[Solid, ...]:
        return _rounded_end(self.radius, self.radius, self.flute)

    def _base(self) -> float:
        return super()._base() if self.flute is None else self.flute


@dataclass(frozen=True)
class Lollipop(_Balled):
    """A ball on a thinner neck, for undercuts. radius: of the ball; neck_radius; reach: from tip to neck's end.

    Metres. The neck counts as shank: it must not touch. Raises ToolpathError unless 0 < neck < ball, 2 radius <
    reach.
    """

    neck_radius: float
    reach: float

    def __post_init__(self) -> None:
        _positive("radius", self.radius)
        if not 0.0 < self.neck_radius < self.radius:
            raise _wrong("neck_radius", self.neck_radius, f"between 0 and the ball's {self.radius} m")
        if not 2.0 * self.radius < self.reach < np.inf:
            raise _wrong("reach", self.reach, f"more than the ball's diameter, {2.0 * self.radius} m")

    def _cutter(self) -> tuple[Solid, ...]:
        ball = Solid("cutter", self.radius, self.radius, 0.0, 0.0, self.radius)
        return (ball, Solid("shank", self.radius, self.reach, self.neck_radius, self.neck_radius))

    def _base(self) -> float:
        return self.reach


@dataclass(frozen=True)
class BullNose(_Mounted):
    """A flat end with a rounded corner. radius: of the cutter; corner: of its rounding; flute: cutting length.

    Metres. It meets the surface on the rounding: where the axis is the normal, it lies flat and the contact is
    under the tip. Raises ToolpathError unless 0 ≤ corner < radius and the flute is longer than the corner.
    """

    radius: float
    corner: float
    flute: float | None = None

    def __post_init__(self) -> None:
        _positive("radius", self.radius)
        if not 0.0 <= self.corner < self.radius:
            raise _wrong("corner", self.corner, f"from 0 to below the cutter's radius, {self.radius} m")
        _flute(self.flute, self.corner)

    @property
    def pivot(self) -> float:
        """The tip."""
        return 0.0

    @property
    def leans(self) -> bool:
        """False: tilting about any one point lifts it off or digs it in."""
        return False

    @property
    def scallop_radius(self) -> float | None:
        """The corner's, which is the least that a bull-nose cutter cuts with; None for a sharp corner."""
        return self.corner or None

    def tips(self, contacts: Floats, normals: Floats, axes: Floats) -> Floats:
        """Return the tips: the contact is the point of the rounding that lies furthest against the normal."""
        flat = normals - np.einsum("...i,...i->...", normals, axes)[..., None] * axes
        sine = np.linalg.norm(flat, axis=-1, keepdims=True)
        outward = np.where(sine > _UPRIGHT, flat / np.where(sine > _UPRIGHT, sine, 1.0), 0.0)
        return contacts + self.corner * (normals - axes) + (self.radius - self.corner) * outward

    def _cutter(self) -> tuple[Solid, ...]:
        if self.corner == 0.0:
            return (Solid("cutter", 0.0, self.flute or self.radius, self.radius, self.radius),)
        return _rounded_end(self.radius, self.corner, self.flute)

    def _base(self) -> float:
        return super()._base() if self.flute is None else self.flute


@dataclass(frozen=True)
class FlatEnd(BullNose):
    """A flat-ended cutter: sharp corner. radius, flute: metres. Raises ToolpathError unless they are positive."""

    corner: float = field(default=0.0, init=False)


@dataclass(frozen=True)
class StandOff(_Mounted):
    """A laser, spray or water jet that keeps its distance. distance: tip to surface along the axis, metres, ≥ 0.

    The nozzle is the shank, from the tip on. Raises ToolpathError for a negative distance.
    """

    distance: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.distance) and self.distance >= 0.0):
            raise ToolpathError("the stand-off must not be negative", key="distance", value=self.distance)

    @property
    def pivot(self) -> float:
        """The spot on the surface, the stand-off below the tip."""
        return -self.distance

    @property
    def leans(self) -> bool:
        """True: about the spot on the surface."""
        return True

    @property
    def scallop_radius(self) -> None:
        """None: what does not cut leaves no ridge."""
        return

    def tips(self, contacts: Floats, normals: Floats, axes: Floats) -> Floats:
        """Return the tips: the stand-off away from the contact along the axis, whatever the normal."""
        del normals
        return contacts + self.distance * axes

    def _cutter(self) -> tuple[Solid, ...]:
        return ()


def _rounded_end(radius: float, corner: float, flute: float | None) -> tuple[Solid, ...]:
    """Return the body of an end rounded with `corner`, and of the flute above it."""
    end = Solid("cutter", corner, corner, radius - corner, radius - corner, corner)
    return (end,) if flute is None else (end, Solid("cutter", corner, flute, radius, radius))


def _flute(flute: float | None, least: float) -> None:
    if flute is not None and not least < flute < np.inf:
        raise _wrong("flute", flute, f"more than {least} m")


def _positive(key: str, value: float) -> None:
    if not (np.isfinite(value) and value > 0.0):
        raise _wrong(key, value, "> 0")


def _wrong(key: str, value: float, expected: str) -> ToolpathError:
    return ToolpathError("impossible tool", key=key, value=value, expected=expected)
