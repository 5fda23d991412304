"""Cells of the 6-SPU platform whose line is a pentapod of the quadratic family (paper, section V: "readily derived").

The sixth leg, from a_6 in the base plane to a joint beside the line, adds one singular hypersurface: where it lies in
the platform's plane, `SixLegPlatform.twist` = 0. (Not, as section V prints, where its platform joint is on the base
plane.) Over each pose of the line the platform's turn is a circle. Where the line misses a_6 the twist is zero at two
places of it, the arm towards a_6 and away from it, and has either sign between; where the line runs through a_6 it is
zero all around. So every cell of the line gives two cells of one dimension more, two of its own dimension, and, if
lines of it run through a_6, one of theirs.

With leg 3's joints as the origin and a_6 = (x_6, y_6, 0), x_6 ≠ 0, a line through a_6 is p = a_6 − s i, and *(derived)*

    pz = −s w,   px = x_6 − s u,   S = w (δ x_6 − s),

three freedoms (s, i), less one for each of w = 0, T = 0, px = 0, and S = 0 where w ≠ 0 (then s = δ x_6).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import as_floats
from pentapod.base.errors import ArrayError, MachineError
from pentapod.base.values import Value
from pentapod.kinematics.families.quadratic import LinearPentapod
from pentapod.kinematics.platforms.six_leg import SixLegPlatform
from pentapod.theory.cell_poses import cell_of
from pentapod.theory.cells import Cell, cell_decomposition

Turn: TypeAlias = Literal["twist > 0", "twist < 0", "arm towards", "arm away", "line through"]
TURNS: tuple[Turn, ...] = ("twist > 0", "twist < 0", "arm towards", "arm away", "line through")


@dataclass(frozen=True)
class PlatformCell(Value):
    """A cell of the line and what the turn about it does.

    line: the pentapod's cell; turn: sign of the twist, or where it is zero; "line through": the line runs through a_6.
    dimension: freedoms of a pose in the cell. regular: whether its poses are not singular; then it is a component.
    """

    line: Cell
    turn: Turn
    dimension: int

    @property
    def regular(self) -> bool:
        """Whether its poses are not singular."""
        return self.line.rank == 5 and self.turn in TURNS[:2]

    def __str__(self) -> str:
        return f"{self.line}; {self.turn}"


@dataclass(frozen=True)
class PlatformCells(Value):
    """All cells of a 6-SPU platform, told apart by signs, in the order of the line's cells."""

    cells: tuple[PlatformCell, ...]

    def counts(self) -> tuple[int, ...]:
        """Return how many cells have dimension 6, 5, 4, 3, 2 and 1."""
        dimensions = [cell.dimension for cell in self.cells]
        return tuple(dimensions.count(d) for d in (6, 5, 4, 3, 2, 1))

    @property
    def components(self) -> tuple[PlatformCell, ...]:
        """The eight cells without singular poses: one for each assembly mode."""
        return tuple(cell for cell in self.cells if cell.regular)


def platform_cell_decomposition(delta: float, sixth_x: float) -> PlatformCells:
    """Return the cells for this δ and a sixth base joint in the base plane at x_6 from leg 3's, metres.

    Raises ArrayError: δ = 0, or x_6 = 0, where a_6 is in no general position.
    """
    x6 = float(as_floats(sixth_x, "sixth_x", ()))
    if x6 == 0.0:
        raise ArrayError("the sixth base joint is level with leg 3's", key="sixth_x", value=x6, expected="x ≠ 0")
    found: list[PlatformCell] = []
    for line in cell_decomposition(delta).cells:
        found += [PlatformCell(line, turn, line.dimension + 1) for turn in TURNS[:2]]
        found += [PlatformCell(line, turn, line.dimension) for turn in TURNS[2:4]]
        through = _through(line, delta * x6)
        if through is not None:
            found.append(PlatformCell(line, TURNS[4], through + 1))
    return PlatformCells(tuple(found))


def _through(line: Cell, own: float) -> int | None:
    """Return the dimension of the lines of a cell that run through a_6, None where there are none. own: δ x_6."""
    w, s, z, x, t = line.signs
    if w == 0:
        if z != 0:
            return None  # a horizontal line above or below a_6
        return 2 - (x == 0) - (t == 0)
    if z == 0:
        return None  # p on the y axis, where s = 0 would ask for x_6 = 0
    if s == 0:
        # s = δ x_6, so that pz = −δ x_6 w: on one side only.
        return 2 if z == -np.sign(own) * (w or 0) else None
    return 3


def platform_cell_of(
    platform: SixLegPlatform, position: ArrayLike, rotation: ArrayLike, *, tolerance: float = 1e-12
) -> int:
    """Return the index of the cell of one pose, position (3,) and rotation (3, 3), in `platform_cell_decomposition`.

    A pose counts as on a surface when a turn or a relative shift by `tolerance` takes it there. Raises MachineError for
    a platform outside the quadratic family or with a sixth base joint off the base plane.
    """
    pentapod = platform.pentapod
    if not isinstance(pentapod, LinearPentapod) or platform.sixth_base[2] != 0.0:
        raise MachineError("no cells are known for it", key="platform", expected="the quadratic family, a_6 in z = 0")
    p, r = as_floats(position, "position", (3,)), as_floats(rotation, "rotation", (3, 3))
    line = cell_decomposition(pentapod.delta).cells[int(cell_of(pentapod, p, r[:, 2], tolerance=tolerance))]
    seen = p + platform.sixth_joint[2] * r[:, 2] - platform.sixth_base
    across = seen - (seen @ r[:, 2]) * r[:, 2]
    arm = r[:, :2] @ platform.sixth_joint[:2]
    size = float(np.linalg.norm(seen)) + float(np.abs(pentapod.base).max())
    sine = float(platform.twist(p, r)) / (float(np.linalg.norm(arm)) * max(float(np.linalg.norm(across)), 1e-300))
    if np.linalg.norm(across) <= tolerance * size:
        turn = TURNS[4]
    elif abs(sine) <= tolerance:
        turn = TURNS[2] if across @ arm < 0.0 else TURNS[3]
    else:
        turn = TURNS[0] if sine > 0.0 else TURNS[1]
    cells = platform_cell_decomposition(pentapod.delta, float(platform.sixth_base[0] - pentapod.base[2, 0])).cells
    return next(k for k, cell in enumerate(cells) if cell.line == line and cell.turn == turn)
