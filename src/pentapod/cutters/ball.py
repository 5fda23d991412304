"""BallCutter: a ball-ended cutter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pentapod.base.keys import Key
from pentapod.cutters.mounted import Balled, check_flute, check_positive, rounded_end
from pentapod.geometry.solids import Solid


@dataclass(frozen=True)
class BallCutter(Balled):
    """A ball-ended cutter. radius: of the ball; flute: cutting length from the tip, the ball alone if None.

    Metres. Raises ToolpathError unless the radius is positive and the flute at least as long.
    """

    flute: Annotated[
        float | None, Key("mm", "cutting length from the tip; above it the shank begins", gt=0.0, le=500.0)
    ] = None

    def __post_init__(self) -> None:
        check_positive("radius", self.radius)
        check_flute(self.flute, self.radius)

    def _cutter(self) -> tuple[Solid, ...]:
        return rounded_end(self.radius, self.radius, self.flute)

    def _base(self) -> float:
        return super()._base() if self.flute is None else self.flute


CUTTER = BallCutter
