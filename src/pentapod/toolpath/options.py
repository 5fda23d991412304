"""PathOptions: what every strategy is told, in SI units; CoverOptions: what those are told that cover a surface."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypeVar

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import ToolpathError, nearest
from pentapod.base.values import Value
from pentapod.geometry.directions import normalised
from pentapod.mesh.region import Region

_Choice = TypeVar("_Choice", bound=StrEnum)


class Entry(StrEnum):
    """How the tool comes to a pass: along its axis, straight ahead of the pass on a ramp, or on an arc into it."""

    AXIS = "axis"
    STRAIGHT = "straight"
    ARC = "arc"


@dataclass(frozen=True, kw_only=True, eq=False)
class PathOptions(Value):
    """What every strategy is told. Lengths in metres, angles in radians, feeds in m/s.

    region: what is machined. view (3,): towards the tool, along which rapids rise; the region's direction when
    None. chordal: how far a chord may leave the line on the mesh. spacing: most between waypoints.
    axis_step: most turning of the axis between waypoints. closest: points nearer than this are one, as far as
    the chordal tolerance allows. shortest: shorter passes are dropped, and reported. clearance: of
    rapids above the part. approach: length of the last stretch to the surface and the first away from it.
    entry: its form. stay: up to this distance the tool stays on the surface from one pass to the
    next; three stepovers when None. hop: up to this distance it hops over the part close by, further it
    retracts to the clearance level; zero: never. feed, link_feed: of the tip. Raises
    ToolpathError for values that make no sense.
    """

    region: Region = field(default_factory=Region)
    view: Floats | tuple[float, float, float] | None = None
    chordal: float = 10e-6
    spacing: float = 2e-3
    axis_step: float = float(np.radians(3.0))
    closest: float = 10e-6
    shortest: float = 0.5e-3
    clearance: float = 10e-3
    approach: float = 3e-3
    entry: Entry | str = Entry.AXIS
    stay: float | None = None
    hop: float = 20e-3
    feed: float = 0.02
    link_feed: float = 0.05

    def __post_init__(self) -> None:
        for name in ("chordal", "spacing", "axis_step", "closest", "clearance", "approach", "feed", "link_feed"):
            positive(name, getattr(self, name))
        not_negative("shortest", self.shortest)
        not_negative("hop", self.hop)
        if self.stay is not None:
            not_negative("stay", self.stay)
        set_frozen(self, entry=chosen("entry", self.entry, Entry))
        view = self.region.direction if self.view is None else self.view
        if not np.linalg.norm(frozen(view, "view", (3,))) > 0.0:
            raise ToolpathError("the view direction has no length", key="view")
        set_frozen(self, view=frozen(normalised(view), "view"))

    @property
    def up(self) -> Floats:
        """The view direction (3,), unit, towards the tool."""
        return np.asarray(self.view)


@dataclass(frozen=True, kw_only=True, eq=False)
class CoverOptions(PathOptions):
    """What strategies are told that cover a surface by passes side by side.

    stepover: most distance between passes, along the surface; or scallop: height of the ridge that is left
    between them, with the surface's curvature and the cutter taken into account (one of the two). fill: whether
    what passes at regular places leave uncovered (where the region narrows or ends) gets lines of its own.
    """

    stepover: float | None = None
    scallop: float | None = None
    fill: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.stepover is None) == (self.scallop is None):
            raise ToolpathError("give the distance between passes once", key="stepover", expected="stepover or scallop")
        for name in ("stepover", "scallop"):
            if getattr(self, name) is not None:
                positive(name, getattr(self, name))


def positive(name: str, value: float) -> None:
    """Raise ToolpathError unless a number is positive and finite."""
    if not (np.isfinite(value) and value > 0.0):
        raise ToolpathError("must be positive", key=name, value=value)


def not_negative(name: str, value: float) -> None:
    """Raise ToolpathError unless a number is finite and not negative."""
    if not 0.0 <= value < np.inf:
        raise ToolpathError("must not be negative", key=name, value=value)


def finite(name: str, value: float) -> None:
    """Raise ToolpathError unless a number is finite."""
    if not np.isfinite(value):
        raise ToolpathError("must be finite", key=name, value=value)


def chosen(name: str, value: str, choices: type[_Choice]) -> _Choice:
    """Return the choice of that name. Raises ToolpathError with the known ones."""
    if value not in tuple(choices):
        known = [str(choice) for choice in choices]
        raise ToolpathError(
            f"unknown {name}", key=name, value=value, expected=" or ".join(known), remedy=nearest(str(value), known)
        )
    return choices(value)
