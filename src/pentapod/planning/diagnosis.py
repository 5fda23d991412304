"""Diagnosis: which limits a placement exceeds, where and by how much, as a refusal."""

from __future__ import annotations

from pentapod.base.arrays import Bools, Floats
from pentapod.base.refusal import Shortfall
from pentapod.geometry.runs import marked_runs
from pentapod.planning.limits.margins import Margins
from pentapod.planning.placement.placed_path import PlacedPath, UnplacedPath


def diagnose(values: Floats, margins: Margins, needed: float) -> tuple[Shortfall, ...]:
    """Return what falls short of the `needed` margin, worst first. values (N, M): each waypoint's margins."""
    blames: list[tuple[float, Shortfall]] = []
    for column, limit in zip((values - needed).T, margins.limits, strict=True):
        if (short := column < 0.0).any():
            worst = float(column.min())
            blames.append((worst, Shortfall(limit.name, ranges(short), limit.shortfall(worst), limit.unit)))
    return tuple(b for _, b in sorted(blames, key=lambda pair: pair[0]))


def ranges(mask: Bools) -> tuple[tuple[int, int], ...]:
    """Return the inclusive index ranges in which mask (N,) is true."""
    return tuple((a, b - 1) for a, b in marked_runs(mask).tolist())


def refusal(
    values: Floats, attempt: PlacedPath, margins: Margins, needed: float, suggestions: tuple[str, ...], *, fixed: bool
) -> UnplacedPath:
    """Return the refusal of a placement whose best margins are values (N, M); suggestions: phrases for "Try to …"."""
    blames = diagnose(values, margins, needed)
    short = int((values.min(axis=1) < needed).sum())
    where = "at the given placement" if fixed else "at the best placement found"
    otherwise = "turn or move the part" if fixed else "scale the part down; no wider cone or large region of it fits"
    return UnplacedPath(
        "placement",
        f"the part does not fit the machine {where}: {short} of {len(values)} waypoints are out of limits",
        blames,
        remedy="Try to " + (", or to ".join(suggestions) or otherwise),
        attempt=attempt,
    )
