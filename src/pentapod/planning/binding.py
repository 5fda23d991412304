"""Which limits bind a plan, where, and how much room they leave: the blame table of a plan that fits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.machine.machine import Machine
from pentapod.planning.blame import ranges
from pentapod.planning.margins import Margins
from pentapod.planning.placed_path import PlacedPath


@dataclass(frozen=True)
class Binding:
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


def bindings(placed: PlacedPath, machine: Machine) -> tuple[Binding, ...]:
    """Return every limit of a plan, the nearest first."""
    known = {limit.name: limit for limit in Margins.of(machine, placed.component).limits}
    nearest = placed.margins.argmin(axis=1)
    found: list[Binding] = []
    for k in np.argsort(placed.margins.min(axis=0), kind="stable"):
        name, column, here = placed.margin_names[k], placed.margins[:, k], nearest == k
        margin, limit = float(column.min()), known.get(name)
        room = float("nan") if limit is None else abs(limit.shortfall(margin))
        unit = "" if limit is None else limit.unit
        found.append(Binding(name, margin, int(column.argmin()), room, unit, float(here.mean()), ranges(here)))
    return tuple(found)
