"""Where in the work volume the tip yields most to a force, and in which direction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.machine.dynamics.deflection import Yielding
from pentapod.machine.machine import Machine


@dataclass(frozen=True, eq=False)
class Softness(Value):
    """The softest and the stiffest that the tip is over all sampled poses, N/m, each in the pose's softest direction.

    direction (3,): of the force to which the tip yields most, machine frame; where: the pose in words.
    """

    softest: float
    stiffest: float
    direction: Floats
    where: str

    @classmethod
    def of(cls, machine: Machine, position: Floats, direction: Floats, where: Callable[[int], str]) -> Softness:
        """Return the extremes over poses (N, 3); where: the place of one of them in words."""
        found = Yielding.of(machine, position, direction)
        soft, stiff = int(found.softest.argmax()), int(found.softest.argmin())
        way = found.ways[soft] * np.sign(found.ways[soft][np.abs(found.ways[soft]).argmax()])
        return cls(float(1.0 / found.softest[soft]), float(1.0 / found.softest[stiff]), way, where(soft))

    def lines(self) -> list[str]:
        """Return the lines of `pentapod machine check`."""
        way = ", ".join(f"{x:+.2f}" for x in self.direction)
        return [
            f"  stiffness at the tip, softest way     {1e-6 * self.softest:.3g} to {1e-6 * self.stiffest:.3g} N/µm; "
            f"the least: {self.where},",
            f"    along ({way}): 10 N move the tip by {1e7 / self.softest:.3g} µm there",
        ]
