"""PathDerivatives: derivatives of legs, tip and tool axis by arc length, at given stations of a piece."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.values import Value
from pentapod.timing.path.paths import PieceLike


@dataclass(frozen=True, eq=False)
class PathDerivatives(Value):
    """Derivatives by s at sorted stations s (n,), order 1 first, up to `order`; each is computed where it is asked for.

    legs: (n, legs) each; tip: (n, 3) each. turn: (n, 3) each, axis × axis′ and axis × axis″: with ṡ and s̈ they give the
    angular velocity turn[0] ṡ and the angular acceleration turn[0] s̈ + turn[1] ṡ², without the twist that an axis does
    not have.
    """

    piece: PieceLike
    s: Floats
    order: int = 2

    @cached_property
    def legs(self) -> tuple[Floats, ...]:
        """The legs' derivatives (n, legs)."""
        return tuple(self.piece.derivatives(self.s, self.order)[1:])

    @cached_property
    def tip(self) -> tuple[Floats, ...]:
        """The tip's derivatives (n, 3)."""
        return tuple(self.piece.pose(self.s, k)[0] for k in range(1, self.order + 1))

    @cached_property
    def turn(self) -> tuple[Floats, ...]:
        """The tool axis's turn (n, 3), by s and by s twice."""
        axis = self.piece.pose(self.s, 0)[1]
        return tuple(np.cross(axis, self.piece.pose(self.s, k)[1]) for k in (1, 2))
