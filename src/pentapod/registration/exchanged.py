"""Legs that were written in each other's column: found by the places of the touches."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from pentapod.base.errors import InputError
from pentapod.geometry.rigid import RigidTransform
from pentapod.machine.machine import Machine
from pentapod.mesh.query.distance import MeshDistance
from pentapod.registration.touches import Touches


@dataclass(frozen=True)
class ExchangedOptions:
    """near: median gap between the planned surface and the touches of an exchange that is told, metres.

    better: that gap as a share of the one without the exchange, and of that of the next exchange, at most.
    """

    near: float = 5e-3
    better: float = 0.2


OPTIONS = ExchangedOptions()


def exchanged_legs(
    machine: Machine, touches: Touches, surface: MeshDistance, planned: RigidTransform
) -> tuple[int, int] | None:
    """Return the two legs, from 1, whose exchange brings the touches to the planned surface; None where none does."""
    count = touches.legs.shape[1]
    found = sorted(
        (_gap(machine, touches, surface, planned, pair), pair) for pair in combinations(range(count), 2)
    )  # fmt: skip
    gap, pair = found[0]
    most = min(_gap(machine, touches, surface, planned, (0, 0)), found[1][0])
    return (pair[0] + 1, pair[1] + 1) if gap <= min(OPTIONS.near, OPTIONS.better * most) else None


def _gap(
    machine: Machine, touches: Touches, surface: MeshDistance, planned: RigidTransform, pair: tuple[int, int]
) -> float:
    """Return the median gap between surface and touches with two legs exchanged, metres."""
    legs = touches.legs.copy()
    legs[:, list(pair)] = legs[:, list(pair[::-1])]
    try:
        centres = replace(touches, legs=legs).centres(machine)
    except InputError:
        return float("inf")
    gaps = surface.points(planned.inverse().apply(centres)).distance - touches.tip_radius
    return float(np.median(np.abs(gaps)))
