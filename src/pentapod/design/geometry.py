"""Geometry: what a design chooses, and what it takes over from the machine that it starts from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.values import Value
from pentapod.machine.parts import Bodies

AROUND = 8
"""Directions of the rim poses whose mean leg directions are the axes of the base joints."""


@dataclass(frozen=True, eq=False)
class Geometry(Value):
    """A linear pentapod and its work volume, metres and radians.

    base (n, 2): base joints in the plane z = 0. offsets (n,): platform joints along the line, towards the tip. delta:
    of the quadratic family, offsets = delta · x; None in the general family. tool_length: from the line's origin to the
    tip. centre (3,), diameter, height, tilt: the work volume. bodies: of the legs and the spindle.
    """

    base: Floats
    offsets: Floats
    delta: float | None
    tool_length: float
    centre: Floats
    diameter: float
    height: float
    tilt: float
    bodies: Bodies

    def __post_init__(self) -> None:
        set_frozen(
            self,
            base=frozen(self.base, "base"),
            offsets=frozen(self.offsets, "offsets"),
            centre=frozen(self.centre, "centre", (3,)),
        )

    @property
    def feet(self) -> Floats:
        """The base joints in space (n, 3)."""
        return np.column_stack([self.base, np.zeros(len(self.base))])

    @property
    def levers(self) -> Floats:
        """From the tip to the platform joints along the platform's direction (n,), negative."""
        return self.offsets - self.tool_length

    def poses(self, unit: Floats) -> tuple[Floats, Floats]:
        """Return tips and platform directions (N, 3) of unit poses (N, 5).

        Unit poses: share of the radius, angle, share of the height in [−1, 1], share of the tilt, its azimuth.
        """
        share, turn, level, lean, azimuth = unit.T
        r, z, theta = 0.5 * self.diameter * share, 0.5 * self.height * level, self.tilt * lean
        tips = self.centre + np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=-1)
        s, c = np.sin(theta), np.cos(theta)
        return tips, np.stack([s * np.cos(azimuth), s * np.sin(azimuth), c], axis=-1)

    def base_axes(self) -> Floats:
        """Return the axes of the base joints' cones (n, 3): the mean directions of the legs on the rim, rounded."""
        tips, directions = self.poses(rim(AROUND, 2, AROUND))
        legs = tips[:, None] + self.levers[:, None] * directions[:, None] - self.feet
        mean = (legs / np.linalg.norm(legs, axis=-1, keepdims=True)).mean(axis=0)
        axes = np.round(mean / np.linalg.norm(mean, axis=-1, keepdims=True), 4)
        return np.asarray(axes / np.linalg.norm(axes, axis=-1, keepdims=True), dtype=np.float64)


def rim(around: int, levels: int, azimuths: int, shares: tuple[float, ...] = (1.0,)) -> Floats:
    """Return unit poses (N, 5): every tip on circles with every direction on circles, with their middle.

    shares: radii of the circles, of tips and directions alike; 1 is the rim.
    """
    turn, azimuth = (2.0 * np.pi * np.arange(count) / count for count in (around, azimuths))
    level = np.linspace(-1.0, 1.0, levels)
    grid = np.meshgrid(shares, turn, level, shares, azimuth + np.pi / (2.0 * azimuths), indexing="ij")
    return np.stack([axis.ravel() for axis in grid], axis=-1)
