"""Spline padding: rows before a motion that is given a speed to start with, and after one that ends at a speed."""

from __future__ import annotations

from collections.abc import Callable
from math import factorial

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.timing.path.joined import Rows
from pentapod.timing.path.paths import PieceLike

ROWS = 16
"""Rows that the spline through all rows needs to forget where they begin: 0.27 of a row's say is left in the next."""


def spline_padding(piece: PieceLike, speed: float, period: float, *, start: bool, tool: bool = False) -> Rows:
    """Return ROWS + 1 rows that come to a piece's start, or leave its end, at constant speed.

    Legs, station and, where `tool` asks for them, tip and axis: by the Taylor polynomials of degree 3 there, through
    which the spline of a controller goes on without a step of acceleration or jerk. The piece's own row is among them.
    """
    station = 0.0 if start else piece.length
    way = speed * period * np.arange(ROWS + 1)
    way = np.asarray(-way[::-1] if start else way, dtype=np.float64)
    at = np.array([station])

    def beyond(of: Callable[[int], Floats]) -> Floats:
        rows = [of(order) * way[:, None] ** order / factorial(order) for order in range(4)]
        return np.asarray(np.sum(rows, axis=0), dtype=np.float64)

    poses = (beyond(lambda order, k=k: piece.pose(at, order)[k]) for k in (0, 1)) if tool else ()
    return Rows(beyond(lambda order: piece(at, order)), station + way, *poses)
