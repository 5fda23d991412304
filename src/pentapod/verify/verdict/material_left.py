"""What the cutter leaves on the surface, at points of it: a map for reports beside the claim."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.values import Value


@dataclass(frozen=True, eq=False)
class MaterialLeft(Value):
    """Heights (N,) along the normal that the swept cutter leaves above points (N, 3) of the region, workpiece frame.

    Metres; upper bounds, by a few per cent of what is allowed; none is larger than `far`. allowed: as much as may be
    left, but for what the cutter's shape must leave.
    """

    points: Floats
    heights: Floats
    allowed: float
    far: float

    def __post_init__(self) -> None:
        set_frozen(self, points=frozen(self.points, "points", (None, 3)))
        set_frozen(self, heights=frozen(self.heights, "heights", (len(self.points),)))
