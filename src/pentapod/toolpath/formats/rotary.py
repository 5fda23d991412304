"""Rotary axes of five-axis machines, degrees: from angles to tool axes and tips, and from tool axes to angles.

`RotaryAxes` lists the rotary axes of any machine from the part to the tool: R is the product of their rotations in this
order. A rotary axis turns the tool against the part by the right-hand rule, as ISO 841 has it, wherever it is built in;
so `table C, table A`, `head C, head A` and `table C, head A` have the same tool axis Rz(C) Rx(A) z.

`Rotary` is what the writers use. XYZAB, as LinuxCNC's pentakins have it: R = Ry(B) Rx(A), so that the axis from the
tip to the spindle is (cos A sin B, −sin A, cos A cos B). XYZBC: R = Rz(C) Ry(B), (sin B cos C, sin B sin C, cos B).
Angles are the nearest to those of the pose before, so that no rotary axis jumps by a turn. Where the tool axis is at a
pole (B = 0 of XYZBC, A = ±90° of XYZAB) the undefined angle keeps its last value.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.base.values import Value

POLE = 1e-9
"""Sine of the angle from a pole up to which the other rotary angle is undefined."""

Vector = tuple[float, float, float]

LETTERS = "ABC"
"""Letters of the rotary axes about x, y and z."""


def turned(letter: str, degrees: float, vector: Vector) -> Vector:
    """Return a vector after a rotation by the right-hand rule: A about x, B about y, C about z."""
    angle = math.radians(degrees)
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = vector
    if letter == "A":
        return x, c * y - s * z, s * y + c * z
    if letter == "B":
        return c * x + s * z, y, c * z - s * x
    return c * x - s * y, s * x + c * y, z


@dataclass(frozen=True)
class RotaryAxis(Value):
    """A rotary axis. letter: A, B or C. in_table: it turns the part, not the tool. sign: −1 if it turns backwards."""

    letter: str
    in_table: bool = True
    sign: float = 1.0


def _name(axis: RotaryAxis) -> str:
    return f"{'table' if axis.in_table else 'head'} {'-' if axis.sign < 0.0 else ''}{axis.letter}"


@dataclass(frozen=True)
class RotaryAxes(Value):
    """The rotary axes of a machine, from the part to the tool.

    centre: the point, metres, in the coordinates of the program, where the axes of the table meet; pivot: the distance,
    metres, from the tip to the point where the axes of the head meet. Both are needed only for moves without tool
    centre point programming while a rotary axis is turned; None where they are not given. Raises ToolpathError for an
    axis that is there twice, and for a table behind a head.

    >>> axes = RotaryAxes.of(["table C", "table A"], centre=(0.0, 0.0, -0.055))
    """

    axes: tuple[RotaryAxis, ...]
    centre: Vector | None = None
    pivot: float | None = None

    def __post_init__(self) -> None:
        letters = [axis.letter for axis in self.axes]
        if len(set(letters)) < len(letters):
            raise ToolpathError("a rotary axis is there twice", key="rotary_axes", value=letters, expected="each once")
        tables = [axis.in_table for axis in self.axes]
        if tables != sorted(tables, reverse=True):
            raise ToolpathError(
                "a table behind a head",
                key="rotary_axes",
                value=list(map(_name, self.axes)),
                expected="axes from the part to the tool: those of the table first",
            )

    @classmethod
    def of(cls, names: Sequence[str], centre: Vector | None = None, pivot: float | None = None) -> RotaryAxes:
        """Return axes by names such as "table C" or "head -A", from the part to the tool.

        Raises ToolpathError for other names.
        """
        axes: list[RotaryAxis] = []
        for name in names:
            place, _, letter = name.partition(" ")
            if place not in ("table", "head") or letter.removeprefix("-") not in tuple(LETTERS):
                expected = '"table" or "head", then A, B or C: ["table C", "head A"]; "-A" turns backwards'
                raise ToolpathError("unknown rotary axis", key="rotary_axes", value=name, expected=expected)
            axes.append(RotaryAxis(letter[-1], place == "table", -1.0 if letter.startswith("-") else 1.0))
        return cls(tuple(axes), centre, pivot)

    @property
    def letters(self) -> str:
        """The letters of the axes."""
        return "".join(axis.letter for axis in self.axes)

    def axis(self, angles: Mapping[str, float]) -> Vector:
        """Return the tool axis, tip → spindle, for angles in degrees by letter."""
        vector = (0.0, 0.0, 1.0)
        for one in reversed(self.axes):
            vector = turned(one.letter, one.sign * angles[one.letter], vector)
        return vector

    def tip(self, point: Vector, angles: Mapping[str, float]) -> Vector | None:
        """Return the tip against the part for a point that is programmed without tool centre point programming, mm.

        None where `centre` or `pivot` is needed and not given.
        """
        moved = [one for one in self.axes if angles[one.letter] % 360.0]
        heads, tables = [one for one in moved if not one.in_table], [one for one in moved if one.in_table]
        if (heads and self.pivot is None) or (tables and self.centre is None):
            return None
        x, y, z = point
        if heads and self.pivot is not None:
            pivot = 1e3 * self.pivot
            arm = (0.0, 0.0, pivot)
            for one in reversed(heads):
                arm = turned(one.letter, one.sign * angles[one.letter], arm)
            x, y, z = x - arm[0], y - arm[1], z + pivot - arm[2]
        if tables and self.centre is not None:
            a, b, c = (1e3 * v for v in self.centre)
            x, y, z = x - a, y - b, z - c
            for one in reversed(tables):
                x, y, z = turned(one.letter, one.sign * angles[one.letter], (x, y, z))
            x, y, z = x + a, y + b, z + c
        return x, y, z


ANY_AXES = RotaryAxes.of(["table C", "table B", "table A"])
"""Every letter once: what to go on with where a machine is not known."""


@dataclass(frozen=True)
class Rotary:
    """words: the two letters. axis: angles (..., 2) in degrees → axes (..., 3). angles: axes (N, 3) → angles (N, 2)."""

    words: tuple[str, str]
    axis: Callable[[Floats], Floats]
    angles: Callable[[Floats], Floats]


def _axis_ab(angles: Floats) -> Floats:
    a, b = np.radians(angles[..., 0]), np.radians(angles[..., 1])
    return np.stack([np.cos(a) * np.sin(b), -np.sin(a), np.cos(a) * np.cos(b)], axis=-1)


def _axis_bc(angles: Floats) -> Floats:
    b, c = np.radians(angles[..., 0]), np.radians(angles[..., 1])
    return np.stack([np.sin(b) * np.cos(c), np.sin(b) * np.sin(c), np.cos(b)], axis=-1)


def _angles_ab(axes: Floats) -> Floats:
    x, y, z = axes.T
    level = np.hypot(x, z)
    return np.degrees(np.stack([np.arctan2(-y, level), _continued(np.arctan2(x, z), level)], axis=1))


def _angles_bc(axes: Floats) -> Floats:
    x, y, z = axes.T
    level = np.hypot(x, y)
    return np.degrees(np.stack([np.arctan2(level, z), _continued(np.arctan2(y, x), level)], axis=1))


def _continued(angle: Floats, level: Floats) -> Floats:
    """Return angles (N,) without jumps by a turn; where `level` (N,) is almost 0, the one before."""
    known = np.flatnonzero(level > POLE)
    if not len(known):
        return np.zeros_like(angle)
    last = known[np.clip(np.searchsorted(known, np.arange(len(angle)), side="right") - 1, 0, None)]
    return np.unwrap(angle[last])


AB = Rotary(("A", "B"), _axis_ab, _angles_ab)
BC = Rotary(("B", "C"), _axis_bc, _angles_bc)
