"""Turned frames of a program: G68, G68.2, CYCLE800, ROT."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pentapod.toolpath.formats.rotary import Vector, turned

_AXES = {"1": "A", "2": "B", "3": "C"}
IDENTITY: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def rotation(angles: Sequence[float], order: str, *, fixed: bool = False) -> tuple[Vector, Vector, Vector]:
    """Return the unit vectors of a frame that was turned about its own axes one after the other, angles in degrees.

    order: axes as "313", 1 for x. fixed: turned about the axes of the frame before, which do not turn along.
    """
    turns = list(zip(order, angles, strict=True))
    columns = list(IDENTITY)
    for axis, angle in turns if fixed else reversed(turns):
        columns = [turned(_AXES[axis], angle, column) for column in columns]
    return columns[0], columns[1], columns[2]


@dataclass(frozen=True)
class Frame:
    """A frame: its origin, millimetres, and unit vectors, in the coordinates outside it."""

    origin: Vector
    columns: tuple[Vector, Vector, Vector] = IDENTITY

    @property
    def axis(self) -> Vector:
        """The third unit vector."""
        return self.columns[2]

    def outside(self, point: Sequence[float]) -> Vector:
        """Return a point of the frame in the coordinates outside it."""
        x, y, z = point
        u, v, w = self.columns
        o = self.origin
        return (
            o[0] + u[0] * x + v[0] * y + w[0] * z,
            o[1] + u[1] * x + v[1] * y + w[1] * z,
            o[2] + u[2] * x + v[2] * y + w[2] * z,
        )

    def inside(self, point: Sequence[float]) -> Vector:
        """Return a point given outside the frame in the coordinates of the frame."""
        d = [p - o for p, o in zip(point, self.origin, strict=True)]
        u, v, w = (sum(a * b for a, b in zip(column, d, strict=True)) for column in self.columns)
        return u, v, w

    def then(self, inner: Frame) -> Frame:
        """Return a frame that is given in this one."""
        origin = self.outside(inner.origin)
        turn = Frame((0.0, 0.0, 0.0), self.columns)
        u, v, w = (turn.outside(column) for column in inner.columns)
        return Frame(origin, (u, v, w))
