"""The cell decomposition of configuration space (paper, section IV) for |δ| < 1, = 1 and > 1.

With leg 3's attachment as the origin and p its platform joint, S = δ w px + T pz, T = 1 − δu. The cells are told
apart by the signs of w, S, pz, px and T alone; py and v do not matter. The paper's cells are those marked `in_paper`:
they have its counts. They do not cover every singular pose: those with px = pz = 0 and w ≠ 0 lie on S = 0 for every
direction, and more are missing where |δ| ≥ 1. All cells together do: they are a partition of R³ × S², and the closure
of each is a union of cells. (Where p meets the y axis is not special to the robot, only to the choice of p: S = 0 is
smooth there, and the paper's half-lines from the origin cut it in two.)
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cache
from typing import Literal, TypeAlias

import numpy as np

from pentapod.base.arrays import Bools, as_floats
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.kinematics.component import COMPONENTS, Component

Signs: TypeAlias = tuple[int | None, int | None, int | None, int | None, int | None]
"""Signs of (w, S, pz, px, T), each −1, 0 or 1; None: not asked for, or the outcome of the others."""

_WORDS = (("w", "0"), ("S", "0"), ("pz", "0"), ("px", "0"), ("δu", "1"))


@dataclass(frozen=True)
class Cell(Value):
    """One cell: where w, S, pz, px and T = 1 − δu have given signs.

    equations and inequalities say so in words; the dimension is 5 less the number of equations. components: those in
    whose closure the cell lies (a component itself: the one). rank: that of the leg Jacobian; 5 less the rank is the
    number of motions that the legs do not hold. in_paper: whether the paper counts the cell. sheets: of how many
    pieces it consists when v is looked at, too (v > 0 and v < 0).
    """

    signs: Signs
    equations: tuple[str, ...]
    inequalities: tuple[str, ...]
    components: tuple[Component, ...]
    rank: int
    in_paper: bool
    sheets: int

    @property
    def dimension(self) -> int:
        """Return the number of freedoms of a pose in the cell."""
        return 5 - len(self.equations)

    def __str__(self) -> str:
        return ", ".join(self.equations + self.inequalities)


@dataclass(frozen=True, eq=False)
class CellDecomposition(Value):
    """All cells for a class of δ, by falling dimension, and how they hang together.

    kind: "|δ| < 1", "|δ| = 1" or "|δ| > 1". incidence (n, n): [a, b] says that cell a lies in the boundary of cell b.
    """

    kind: Literal["|δ| < 1", "|δ| = 1", "|δ| > 1"]
    cells: tuple[Cell, ...]
    incidence: Bools

    def counts(self, *, paper: bool = False) -> tuple[int, int, int, int, int]:
        """Return how many cells have dimension 5, 4, 3, 2 and 1: all of them, or those that the paper counts."""
        dimensions = [cell.dimension for cell in self.cells if cell.in_paper or not paper]
        five, four, three, two, one = (dimensions.count(d) for d in (5, 4, 3, 2, 1))
        return five, four, three, two, one

    def boundary(self, cell: int) -> tuple[int, ...]:
        """Return the cells that make up the boundary of a cell, by their indices."""
        return tuple(int(k) for k in np.flatnonzero(self.incidence[:, cell]))


def cell_decomposition(delta: float) -> CellDecomposition:
    """Return the cells of the pentapods with this δ, where ±1 is meant to the last digit. Raises ArrayError for 0."""
    slope = float(as_floats(delta, "delta", ()))
    if slope == 0.0:
        raise ArrayError("delta is 0: every pose is singular", expected="delta ≠ 0")
    return _decomposition(slope)


@cache
def _decomposition(slope: float) -> CellDecomposition:
    tilts = (1,) if abs(slope) <= 1.0 else (1, -1)
    touches = abs(slope) >= 1.0  # whether u = 1/δ is a direction
    described: list[tuple[Signs, bool]] = []
    for w, s in COMPONENTS:
        described.append(((w, s, None, None, None), True))
    for z, t in itertools.product((1, -1), tilts):
        described.append(((0, None, z, None, t), True))
    for w, z in itertools.product((1, -1), repeat=2):
        described.append(((w, 0, z, None, None), True))
    for x, t in itertools.product((1, -1), tilts):
        described.append(((0, None, 0, x, t), True))
    for z, x in itertools.product((1, -1), repeat=2) if touches else ():
        described.append(((0, None, z, x, 0), True))
    for w in (1, -1):
        described.append(((w, None, 0, 0, None), False))
    for x in (1, -1) if touches else ():
        described.append(((0, None, 0, x, 0), True))
    for t in tilts:
        described.append(((0, None, 0, 0, t), not touches))
    for z in (1, -1) if touches else ():
        described.append(((0, None, z, 0, 0), False))
    if touches:
        described.append(((0, None, 0, 0, 0), True))

    patterns = [_patterns(signs, slope) for signs, _ in described]
    incidence = np.array([[a is not b and _touches(a, b) for b in patterns] for a in patterns], dtype=np.bool_)
    incidence.flags.writeable = False
    cells = tuple(
        Cell(
            signs,
            tuple(f"{name} = {value}" for (name, value), sign in zip(_WORDS, signs, strict=True) if sign == 0),
            tuple(_inequality(k, sign) for k, sign in enumerate(signs) if sign),
            tuple(c for k, c in enumerate(COMPONENTS) if a == k or incidence[a, k]),
            _rank(signs),
            in_paper,
            2 if signs[4] == 0 and abs(slope) > 1.0 else 1,
        )
        for a, (signs, in_paper) in enumerate(described)
    )
    kind = "|δ| < 1" if not touches else "|δ| = 1" if abs(slope) == 1.0 else "|δ| > 1"
    return CellDecomposition(kind, cells, incidence)


def _rank(signs: Signs) -> int:
    w, s, z, x, t = signs
    if w == 0 and z == 0:  # the line lies on the base: no leg can push it off
        return 2 if x == 0 and t == 0 else 3
    return 5 if w != 0 and s else 4


def _inequality(which: int, sign: int) -> str:
    name, value = _WORDS[which]
    greater = (sign > 0) != (name == "δu")  # T = 1 − δu falls as δu grows
    return f"{name} {'>' if greater else '<'} {value}"


def _patterns(signs: Signs, delta: float) -> list[tuple[int, ...]]:
    """Return the full sign vectors (w, S, pz, px, T) that a cell's poses can have."""
    choices = ((-1, 0, 1) if sign is None else (sign,) for sign in signs)
    found: list[tuple[int, ...]] = []
    for w, s, z, x, t in itertools.product(*choices):
        if abs(delta) < 1.0 and t != 1:
            continue
        if abs(delta) == 1.0 and (t < 0 or (t == 0 and w != 0)):
            continue
        parts = {(1 if delta > 0.0 else -1) * w * x, t * z} - {0}  # S is a sum of two terms with these signs
        if (len(parts) == 2) or s == (parts.pop() if parts else 0):
            found.append((w, s, z, x, t))
    return found


def _touches(inner: list[tuple[int, ...]], outer: list[tuple[int, ...]]) -> bool:
    """Return whether poses of `outer` come arbitrarily near those of `inner`: signs may only fall to 0 in the limit."""
    return any(all(i in (0, o) for i, o in zip(a, b, strict=True)) for a in inner for b in outer)
