"""Active limits: the limits of a plan that fits, where they are nearest, and the room that they leave."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.planning.diagnosis import ranges
from pentapod.planning.placement.placed_path import PlacedPath


@dataclass(frozen=True)
class ActiveLimit:
    """One limit. margin: the smallest one, at waypoint `worst`; room: the same in `unit` (mm, deg).

    waypoints: inclusive ranges in which no other limit is nearer; share: of all waypoints.
    """

    limit: str
    margin: float
    worst: int
    room: float
    unit: str
    share: float
    waypoints: tuple[tuple[int, int], ...]


def active_limits(placed: PlacedPath) -> tuple[ActiveLimit, ...]:
    """Return every limit of a plan, the nearest first."""
    nearest = placed.margins.argmin(axis=1)
    found: list[ActiveLimit] = []
    for k in np.argsort(placed.margins.min(axis=0), kind="stable"):
        limit, column, here = placed.limits[k], placed.margins[:, k], nearest == k
        margin, worst = float(column.min()), int(column.argmin())
        room, share = abs(limit.shortfall(margin)), float(here.mean())
        found.append(ActiveLimit(limit.name, margin, worst, room, limit.unit, share, ranges(here)))
    return tuple(found)
