"""FlatEnd: a flat-ended cutter with a sharp corner."""

from __future__ import annotations

from dataclasses import dataclass, field

from pentapod.cutters.bull_nose import BullNose


@dataclass(frozen=True)
class FlatEnd(BullNose):
    """A flat-ended cutter with a sharp corner. radius, flute: metres. Raises ToolpathError unless they are positive.

    >>> FlatEnd(4e-3, flute=0.01).radius
    0.004
    """

    corner: float = field(default=0.0, init=False)


CUTTER = FlatEnd
