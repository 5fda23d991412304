"""Played: what a simulated machine made of a program."""

from __future__ import annotations

from dataclasses import dataclass

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.values import Result


@dataclass(frozen=True, eq=False)
class Played(Result):
    """Where the tool really was at each row of the program, machine frame.

    legs (N, n): leg lengths; tips (N, 3), metres; directions (N, 3) of the platform. forces (N, n): of the drives on
    what they move, newtons.
    """

    legs: Floats
    tips: Floats
    directions: Floats
    forces: Floats

    def __post_init__(self) -> None:
        set_frozen(
            self,
            legs=frozen(self.legs, "legs", (None, None)),
            tips=frozen(self.tips, "tips", (None, 3)),
            directions=frozen(self.directions, "directions", (None, 3)),
            forces=frozen(self.forces, "forces", (None, None)),
        )
