"""BallCutter: a ball-ended cutter."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.cutters.mounted import BallEnded, Flute, check_flute, check_positive, rounded_end
from pentapod.geometry.solids import Solid


@dataclass(frozen=True)
class BallCutter(BallEnded):
    """A ball-ended cutter. radius: of the ball; flute: cutting length from the tip, None for the ball alone; metres.

    Raises ToolpathError unless the radius is positive and the flute longer than it.

    >>> tool = BallCutter(3e-3, shank=(Cone(0.03, 3e-3, 3e-3),))
    >>> tool.tilt_centre
    0.003
    """

    flute: Flute = None

    def __post_init__(self) -> None:
        check_positive("radius", self.radius)
        check_flute(self.flute, self.radius)

    def _cutter(self) -> tuple[Solid, ...]:
        return rounded_end(self.radius, self.radius, self.flute)


CUTTER = BallCutter
