"""Convex solids of revolution that tools are made of.

A `Solid` is the Minkowski sum of a frustum and a ball: cylinders and cones have a ball of no radius, a ball has a point
as its frustum, the end of a bull-nose cutter a disc.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from pentapod.base.errors import ToolpathError
from pentapod.base.values import Value

KINDS = ("cutter", "shank", "holder")
"""Parts of a tool, in the order of reports."""


@dataclass(frozen=True)
class Solid:
    """All points within `rounding` of a frustum about the tool's axis. Metres; heights above the tip.

    kind: one of `KINDS`. low, high: heights of the frustum's ends. low_radius, high_radius: its radii there.
    Raises ToolpathError for a negative radius, and for ends in the wrong order.
    """

    kind: str
    low: float
    high: float
    low_radius: float
    high_radius: float
    rounding: float = 0.0

    def __post_init__(self) -> None:
        numbers = (self.low, self.high, self.low_radius, self.high_radius, self.rounding)
        if self.kind not in KINDS:
            raise ToolpathError("unknown kind of solid", key="kind", value=self.kind, expected=", ".join(KINDS))
        if not np.isfinite(numbers).all() or self.high < self.low or min(numbers[2:]) < 0.0:
            raise ToolpathError("impossible solid", value=numbers, expected="low ≤ high, and no negative radius")

    @property
    def top(self) -> float:
        """Height of its highest point."""
        return self.high + self.rounding

    @property
    def largest_radius(self) -> float:
        """Largest distance of its points from the tool's axis."""
        return max(self.low_radius, self.high_radius) + self.rounding

    @property
    def thickness(self) -> float:
        """Upper bound, metres, on the depth of a point inside: at least the radius of the largest ball that fits in."""
        return min(max(self.low_radius, self.high_radius), 0.5 * (self.high - self.low)) + self.rounding

    @property
    def is_ball(self) -> bool:
        """Whether it is a ball."""
        return self.low == self.high and self.low_radius == self.high_radius == 0.0

    @property
    def numbers(self) -> tuple[float, float, float, float, float]:
        """Numbers for the kernels: low, high, low_radius, high_radius, rounding."""
        return (self.low, self.high, self.low_radius, self.high_radius, self.rounding)


@dataclass(frozen=True)
class Cone(Value):
    """Piece of a shank or holder: a cylinder, or a frustum where the radii differ. Metres.

    Raises ToolpathError unless the height and a radius are positive.

    >>> holder = (Cone(0.01, 4e-3, 10e-3), Cone(0.03, 10e-3, 10e-3))
    >>> tool = BallCutter(3e-3, shank=(Cone(0.03, 3e-3, 3e-3),), holder=holder)
    """

    height: float
    lower_radius: float
    upper_radius: float

    def __post_init__(self) -> None:
        radii = (self.lower_radius, self.upper_radius)
        if not (np.isfinite((self.height, *radii)).all() and self.height > 0.0 and min(radii) >= 0.0 < max(radii)):
            raise ToolpathError("impossible cone", value=(self.height, *radii), expected="height > 0, radii ≥ 0")


def stacked(kind: str, cones: Iterable[Cone], base: float) -> tuple[Solid, ...]:
    """Return the solids of cones stacked from height `base` upwards."""
    solids: list[Solid] = []
    for cone in cones:
        solids.append(Solid(kind, base, base + cone.height, cone.lower_radius, cone.upper_radius))
        base += cone.height
    return tuple(solids)
