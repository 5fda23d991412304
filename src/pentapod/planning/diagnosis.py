"""Diagnosis: the limits that a placement exceeds, as a refusal, and the active limits of one that fits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Bools, Floats
from pentapod.base.refusal import Shortfall
from pentapod.geometry.runs import marked_runs
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.placed_path import PlacedPath, UnplacedPath


@dataclass(frozen=True)
class ActiveLimit:
    """One limit of a plan. margin: the smallest one, at waypoint `worst`; room: the same in `unit` (mm, deg).

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
        found.append(ActiveLimit(limit.name, margin, worst, room, limit.unit, share, _ranges(here)))
    return tuple(found)


def diagnose(values: Floats, margins: Margins, needed: float) -> tuple[Shortfall, ...]:
    """Return the limits below the `needed` margin, the worst first. values (N, M): each waypoint's margins."""
    found: list[tuple[float, Shortfall]] = []
    for column, limit in zip((values - needed).T, margins.limits, strict=True):
        if (short := column < 0.0).any():
            worst = float(column.min())
            found.append((worst, Shortfall(limit.name, _ranges(short), limit.shortfall(worst), limit.unit)))
    return tuple(shortfall for _, shortfall in sorted(found, key=lambda pair: pair[0]))


def refusal(values: Floats, attempt: PlacedPath, margins: Margins, needed: float, *, fixed: bool) -> UnplacedPath:
    """Return the refusal of a placement whose best margins are values (N, M)."""
    short = int((values.min(axis=1) < needed).sum())
    where = "at the given placement" if fixed else "at the best placement found"
    return UnplacedPath(
        "placement",
        f"the part does not fit the machine {where}: {short:,} of {len(values):,} waypoints are out of limits",
        diagnose(values, margins, needed),
        attempt=attempt,
    )


def _ranges(mask: Bools) -> tuple[tuple[int, int], ...]:
    """Return the inclusive index ranges in which mask (N,) is true."""
    return tuple((a, b - 1) for a, b in marked_runs(mask).tolist())
