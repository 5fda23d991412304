"""RasterOptions: what a raster strategy is told, in SI units."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from pentapod.arrays import Floats, frozen, set_frozen
from pentapod.errors import ToolpathError
from pentapod.geometry.directions import normalised
from pentapod.toolpath.region import Region


class Pattern(StrEnum):
    """zigzag: cut both ways, staying down where the next pass is near. one-way: always the same way."""

    ZIGZAG = "zigzag"
    ONE_WAY = "one-way"


@dataclass(frozen=True, kw_only=True, eq=False)
class RasterOptions:
    """How a surface is covered by parallel passes. Lengths in metres, angles in radians, feeds in m/s.

    stepover: distance between the slicing planes; or scallop: height of the ridge a ball leaves (one of the
    two). direction: of the passes, about the view from its x axis towards its y axis; for the view +z these
    are x and y, for others they are carried along (`geometry.tangent_frame`). view (3,): towards the tool,
    within the slicing planes; the region's direction when None. region: what is machined. chordal: how far
    a chord may leave the mesh's slice. spacing: most between waypoints. axis_step: most turning of the axis
    between waypoints. closest: points nearer than this are one. shortest: shorter passes are dropped, and
    reported. clearance: of rapids above the part. approach: length of the last stretch along the axis.
    feed, link_feed: of the tip. Raises ToolpathError for values that make no sense.
    """

    stepover: float | None = None
    scallop: float | None = None
    direction: float = 0.0
    pattern: Pattern | str = Pattern.ZIGZAG
    view: Floats | tuple[float, float, float] | None = None
    region: Region = field(default_factory=Region)
    chordal: float = 10e-6
    spacing: float = 2e-3
    axis_step: float = float(np.radians(3.0))
    closest: float = 10e-6
    shortest: float = 1e-3
    clearance: float = 10e-3
    approach: float = 3e-3
    feed: float = 0.02
    link_feed: float = 0.05

    def __post_init__(self) -> None:
        for name in (
            "chordal",
            "spacing",
            "axis_step",
            "closest",
            "clearance",
            "approach",
            "feed",
            "link_feed",
        ):
            _positive(name, getattr(self, name))
        if (self.stepover is None) == (self.scallop is None):
            raise ToolpathError("give the distance between passes once", key="stepover", expected="stepover or scallop")
        if self.stepover is not None:
            _positive("stepover", self.stepover)
        if self.scallop is not None:
            _positive("scallop", self.scallop)
        if not 0.0 <= self.shortest < np.inf:
            raise ToolpathError("must not be negative", key="shortest", value=self.shortest)
        if not np.isfinite(self.direction):
            raise ToolpathError("must be finite", key="direction", value=self.direction)
        if self.pattern not in tuple(Pattern):
            raise ToolpathError("unknown pattern", key="pattern", value=self.pattern, expected=" or ".join(Pattern))
        set_frozen(self, pattern=Pattern(self.pattern))
        view = self.region.direction if self.view is None else self.view
        if not np.linalg.norm(frozen(view, "view", (3,))) > 0.0:
            raise ToolpathError("the view direction has no length", key="view")
        set_frozen(self, view=frozen(normalised(view), "view"))


def _positive(name: str, value: float) -> None:
    if not (np.isfinite(value) and value > 0.0):
        raise ToolpathError("must be positive", key=name, value=value)
