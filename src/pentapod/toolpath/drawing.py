"""Drawing: the contact lines that a strategy makes on the surface, before waypoints and links."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from pentapod.base.arrays import Floats, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.mesh.passes import Passes


class Order(StrEnum):
    """Which pass follows which.

    zigzag: on to the next level while a pass there begins nearby. by-level: level by level. shortest: such that
    travel is short. given: as they are.
    """

    ZIGZAG = "zigzag"
    BY_LEVEL = "by-level"
    SHORTEST = "shortest"
    GIVEN = "given"


@dataclass(frozen=True, eq=False)
class Drawing:
    """Lines on a surface, each point of them exactly on it or below it, and how they are to be cut.

    passes: the lines, as fine as the mesh. stepover: metres between neighbours along the surface at most; 0 where
    they do not cover it. order: see `Order`. both_ways: whether a pass may be cut backwards. sink: by how much lines
    lie below the surface at most, along the normal, metres. power (P,): share of full power on each pass, 0 to
    1, or None for full. visible: the lines lie on top as seen along the view.
    notes: sentences for the report.
    """

    passes: Passes
    stepover: float = 0.0
    order: Order = Order.SHORTEST
    both_ways: bool = True
    sink: float = 0.0
    power: Floats | None = None
    visible: bool = False
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        set_frozen(self, order=Order(self.order))
        if not len(self.passes):
            raise ToolpathError("the strategy draws no line", key="region", remedy="check the region and the unit")
