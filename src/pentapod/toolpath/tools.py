"""Tools as the workpiece sees them: where the tip is when the tool meets the surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pentapod.arrays import Floats
from pentapod.errors import ToolpathError


class Tool(Protocol):
    """What meets the surface. `pivot` is as in `Toolpath`."""

    @property
    def pivot(self) -> float:
        """Distance in metres from the tip along the axis to the point about which the tool may tilt."""
        ...

    def tips(self, contacts: Floats, normals: Floats, axes: Floats) -> Floats:
        """Return the tips (N, 3) of a tool with axes (N, 3) that meets contacts (N, 3); normals are unit."""
        ...


@dataclass(frozen=True)
class BallCutter:
    """A ball-ended cutter. radius: of the ball, metres. Raises ToolpathError unless it is positive."""

    radius: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.radius) and self.radius > 0.0):
            raise ToolpathError("the ball's radius must be positive", key="radius", value=self.radius)

    @property
    def pivot(self) -> float:
        """The ball's centre, a radius above the tip."""
        return self.radius

    def tips(self, contacts: Floats, normals: Floats, axes: Floats) -> Floats:
        """Return the tips: the ball's centre lies a radius above the contact along the normal."""
        return contacts + self.radius * (normals - axes)


@dataclass(frozen=True)
class StandOff:
    """A beam or spray that keeps its distance. distance: tip to surface along the axis, metres, ≥ 0.

    Raises ToolpathError for a negative distance.
    """

    distance: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.distance) and self.distance >= 0.0):
            raise ToolpathError("the stand-off must not be negative", key="distance", value=self.distance)

    @property
    def pivot(self) -> float:
        """The spot on the surface, the stand-off below the tip."""
        return -self.distance

    def tips(self, contacts: Floats, normals: Floats, axes: Floats) -> Floats:
        """Return the tips: the stand-off away from the contact along the axis, whatever the normal."""
        del normals
        return contacts + self.distance * axes
