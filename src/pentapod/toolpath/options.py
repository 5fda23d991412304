"""Options of all strategies (PathOptions) and of those that cover a surface (CoverOptions), in SI units.

The keys of [toolpath] in a job file are declared here and beside each strategy, with the fields.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated, Any, ClassVar

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key, check_fields
from pentapod.base.values import Value
from pentapod.geometry.directions import normalised
from pentapod.mesh.region import Region


class Entry(StrEnum):
    """How the tool comes to a pass: along its axis, straight ahead of the pass on a ramp, or on an arc into it."""

    AXIS = "axis"
    STRAIGHT = "straight"
    ARC = "arc"


@dataclass(frozen=True, kw_only=True, eq=False)
class PathOptions(Value):
    """What every strategy takes. Lengths in metres, angles in radians, feeds in m/s.

    region: what is machined. view (3,): towards the tool, along which rapids rise; the region's direction when
    None. chordal: how far a chord may leave the line on the mesh. feed, link_feed: of the tip. The other fields are
    keys of job files, with their meaning. Raises ToolpathError for values out of range.
    """

    region: Region = field(default_factory=Region)
    view: Floats | tuple[float, float, float] | None = None
    chordal: float = 10e-6
    clearance: Annotated[float, Key("mm", "height of rapids above the part", gt=0.0)] = 10e-3
    approach: Annotated[float, Key("mm", "height of the stretch on feed, to and from a cut", gt=0.0)] = 3e-3
    entry: Annotated[
        Entry | str, Key("", 'form of that stretch: along the "axis", a "straight" ramp ahead, or an "arc"')
    ] = Entry.AXIS
    stay: Annotated[
        float | None,
        Key("mm", "up to this far the tool stays on the surface between passes; 3 stepovers when left out", ge=0.0),
    ] = None
    hop: Annotated[float, Key("mm", "up to this far it hops over the part, further it retracts", ge=0.0)] = 20e-3
    spacing: Annotated[float, Key("mm", "largest distance between waypoints on the surface", gt=0.0)] = 2e-3
    closest: Annotated[float, Key("mm", "waypoints nearer than this are one, if chordal_mm allows", gt=0.0)] = 10e-6
    shortest: Annotated[float, Key("mm", "shorter passes are left out, and reported", ge=0.0)] = 0.5e-3
    axis_step: Annotated[float, Key("deg", "largest turn of the axis between waypoints", gt=0.0, le=30.0)] = float(
        np.radians(3.0)
    )
    feed: float = 0.02
    link_feed: float = 0.05

    def __post_init__(self) -> None:
        for name in ("chordal", "feed", "link_feed"):
            positive(name, getattr(self, name))
        check_fields(self, ToolpathError)
        view = self.region.direction if self.view is None else self.view
        if not np.linalg.norm(frozen(view, "view", (3,))) > 0.0:
            raise ToolpathError("the view direction has no length", key="view")
        set_frozen(self, view=frozen(normalised(view), "view"))

    @property
    def up(self) -> Floats:
        """The view direction (3,), unit, towards the tool."""
        return np.asarray(self.view)

    @classmethod
    def sink_of(cls, values: Any) -> float:
        """Return how far below the surface these options, or SI values of their keys, bring the tool: metres."""
        return float(getattr(values, "depth", 0.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class CoverOptions(PathOptions):
    """What strategies take that cover a surface by passes side by side: one of stepover and scallop, and fill.

    The scallop takes the surface's curvature and the cutter into account.
    """

    stepover: Annotated[
        float | None, Key("mm", "largest distance between passes along the surface; or scallop_mm", gt=0.0, of_part=1.0)
    ] = None
    scallop: Annotated[float | None, Key("mm", "height of the ridge left between passes", gt=0.0, of_part=1.0)] = None
    fill: Annotated[bool, Key("", "additional lines where regular passes leave gaps")] = True

    one_of: ClassVar[tuple[str, str]] = ("stepover", "scallop")
    """Fields of which exactly one is given."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.stepover is None) == (self.scallop is None):
            raise ToolpathError("give the distance between passes once", key="stepover", expected="stepover or scallop")


def positive(name: str, value: float) -> None:
    """Raise ToolpathError unless a number is positive and finite."""
    if not (np.isfinite(value) and value > 0.0):
        raise ToolpathError("must be positive", key=name, value=value)
