"""Lollipop: a ball on a thinner neck."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from pentapod.base.keys import Key
from pentapod.cutters.mounted import BallEnded, check_positive, size_error
from pentapod.geometry.solids import Solid


@dataclass(frozen=True)
class Lollipop(BallEnded):
    """A ball on a thinner neck, for undercuts. radius: of the ball; reach: from the tip to the neck's end; metres.

    The neck counts as shank: it must not touch. Raises ToolpathError unless 0 < neck_radius < radius and
    2 radius < reach.

    >>> Lollipop(4e-3, neck_radius=2e-3, reach=0.03).tilt_centre
    0.004
    """

    neck_radius: Annotated[float, Key("mm", "lollipop: diameter of the neck", name="neck", share=0.5, gt=0.0, le=100.0)]
    reach: Annotated[float, Key("mm", "lollipop: from the tip to the neck's end", gt=0.0, le=500.0)]

    def __post_init__(self) -> None:
        check_positive("radius", self.radius)
        if not 0.0 < self.neck_radius < self.radius:
            raise size_error("neck_radius", self.neck_radius, f"between 0 and the ball's {self.radius} m")
        if not 2.0 * self.radius < self.reach < np.inf:
            raise size_error("reach", self.reach, f"more than the ball's diameter, {2.0 * self.radius} m")

    def _cutter(self) -> tuple[Solid, ...]:
        ball = Solid("cutter", self.radius, self.radius, 0.0, 0.0, self.radius)
        return (ball, Solid("shank", self.radius, self.reach, self.neck_radius, self.neck_radius))


CUTTER = Lollipop
