"""Options of all strategies (`PathOptions`) and of those that cover a surface (`CoverOptions`), in SI units.

Fields with a `Key` are the keys of [toolpath] in a job file; further ones are declared beside each strategy.
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
    """Lead-in and lead-out of a pass: along the tool axis, on a straight ramp ahead of the pass, or on an arc."""

    AXIS = "axis"
    STRAIGHT = "straight"
    ARC = "arc"


SHORTEST_M, SHORTEST_STEPOVERS = 0.5e-3, 0.2
"""Length of a pass, metres and stepovers, of which the smaller one decides: small cutters make short passes."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PathOptions(Value):
    """Options of every strategy. Lengths in metres, angles in radians, feeds of the tool tip in m/s.

    region: what is machined. view (3,): direction towards the tool, in which rapids rise; None for the region's
    direction. chordal: largest distance of a chord from the line on the mesh. Raises ToolpathError for values out of
    range.
    """

    region: Region = field(default_factory=Region)
    view: Floats | tuple[float, float, float] | None = None
    chordal: float = 10e-6
    clearance: Annotated[float, Key("mm", "height of rapids above the part", gt=0.0)] = 10e-3
    approach: Annotated[float, Key("mm", "height of approach and retract on feed, above a cut", gt=0.0)] = 3e-3
    entry: Annotated[
        Entry | str, Key("", 'form of approach and retract: along the "axis", a "straight" ramp, or an "arc"')
    ] = Entry.AXIS
    stay: Annotated[
        float | None,
        Key(
            "mm",
            "largest distance between passes for a link on the surface; when left out: 3 stepovers, and for a tool "
            "that stands off at least 4 times approach_mm",
            ge=0.0,
        ),
    ] = None
    hop: Annotated[float, Key("mm", "largest distance between passes for a hop just above the part", ge=0.0)] = 20e-3
    spacing: Annotated[float, Key("mm", "largest distance between waypoints on the surface", gt=0.0)] = 2e-3
    closest: Annotated[float, Key("mm", "waypoints nearer than this are merged, if chordal_mm allows", gt=0.0)] = 10e-6
    shortest: Annotated[
        float | None,
        Key(
            "mm",
            "shorter passes are left out, and reported; 0.5, or a fifth of the stepover if less, when left out",
            ge=0.0,
        ),
    ] = None
    axis_step: Annotated[float, Key("deg", "largest turn of the axis between waypoints", gt=0.0, le=30.0)] = float(
        np.radians(3.0)
    )
    feed: float = 0.02
    link_feed: float = 0.05

    rolls: ClassVar[bool] = False
    """Whether lines are drawn on the drive surface of a ball."""

    def __post_init__(self) -> None:
        for name in ("chordal", "feed", "link_feed"):
            check_positive(name, getattr(self, name))
        check_fields(self, ToolpathError)
        set_frozen(self, view=unit_vector("view", self.region.direction if self.view is None else self.view))

    def shortest_pass(self, stepover: float) -> float:
        """Return the length below which passes are left out, metres. stepover: between passes; 0 without."""
        if self.shortest is not None:
            return self.shortest
        return min(SHORTEST_M, SHORTEST_STEPOVERS * stepover) if stepover > 0.0 else SHORTEST_M

    @property
    def up(self) -> Floats:
        """The view direction (3,), unit, towards the tool."""
        return np.asarray(self.view)

    @classmethod
    def depth_of(cls, values: Any) -> float:
        """Return how deep below the surface these options, or SI values of their keys, bring the tool: metres."""
        return float(getattr(values, "depth", 0.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class CoverOptions(PathOptions):
    """Options of strategies that cover a surface by passes side by side. Either stepover or scallop is given.

    The stepover for a scallop depends on the curvature of the surface and on the cutter.
    """

    stepover: Annotated[
        float | None, Key("mm", "largest distance between passes along the surface; or scallop_mm", gt=0.0)
    ] = None
    scallop: Annotated[float | None, Key("mm", "height of the ridge left between passes", gt=0.0, of_part=1.0)] = None
    fill: Annotated[bool, Key("", "additional lines where regular passes leave gaps")] = True
    under: Annotated[
        float | None,
        Key(
            "mm",
            "by how much surface may lean over a ball's centre; a fifth of its radius when left out, 0 for what an "
            "upright tool reaches",
            ge=0.0,
        ),
    ] = None

    rolls: ClassVar[bool] = True

    one_of: ClassVar[tuple[str, str]] = ("stepover", "scallop")
    """Fields of which exactly one is given."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.stepover is None) == (self.scallop is None):
            raise ToolpathError("give the distance between passes once", key="stepover", expected="stepover or scallop")


def check_positive(name: str, value: float) -> None:
    """Raise ToolpathError unless a number is positive and finite."""
    if not (np.isfinite(value) and value > 0.0):
        raise ToolpathError("must be positive", key=name, value=value)


def unit_vector(name: str, direction: Any) -> Floats:
    """Return a direction (3,), any length, as a read-only unit vector. Raises ToolpathError if it has no length."""
    if not np.linalg.norm(frozen(direction, name, (3,))) > 0.0:
        raise ToolpathError("the direction has no length", key=name)
    return frozen(normalised(direction), name)
