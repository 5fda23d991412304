"""PathDerivatives: how a piece of the path moves at given stations, as far as something limits it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats, Ints
from pentapod.timing.law.paths import PieceLike


@dataclass(frozen=True, eq=False)
class PathDerivatives:
    """Derivatives by s at stations (n,), order 1 first: the rates of what moves along the path.

    legs: (n, 5) each. tip: (n, 3) each, where something limits the tip's acceleration or jerk. turn: (n, 3) each,
    axis × axis′ and axis × axis″, where something limits the axis: with ṡ and s̈ they give the angular velocity
    turn[0] ṡ and the angular acceleration turn[0] s̈ + turn[1] ṡ². speed (n,): largest ṡ by feed and rapid rate, m/s;
    section (n,): the one that sets it.
    """

    legs: tuple[Floats, ...]
    tip: tuple[Floats, ...]
    turn: tuple[Floats, ...]
    speed: Floats
    section: Ints


def legs_along(piece: PieceLike, s: Floats, order: int) -> tuple[Floats, ...]:
    """Return the derivatives of the legs (n, 5) by s, order 1 to `order`."""
    return tuple(piece.derivatives(s, order)[1:])


def tip_along(piece: PieceLike, s: Floats, order: int) -> tuple[Floats, ...]:
    """Return the derivatives of the tip (n, 3) by s, order 1 to `order`."""
    return tuple(piece.pose(s, k)[0] for k in range(1, order + 1))


def turn_along(piece: PieceLike, s: Floats) -> tuple[Floats, ...]:
    """Return the axis's turn (n, 3) by s and by s twice, without the twist that an axis does not have."""
    axis = piece.pose(s, 0)[1]
    return tuple(np.cross(axis, piece.pose(s, k)[1]) for k in (1, 2))
