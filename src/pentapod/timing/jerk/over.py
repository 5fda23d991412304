"""Where setpoints of a law exceed the limits as the controller joins them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pentapod.base.arrays import Floats

Run = tuple[Floats, Floats, Floats]
"""Stations, x and x′ (n,) of a part of a law."""


@dataclass(frozen=True, eq=False)
class Over:
    """Sorted stations (n,) where setpoints of a law exceed, and by which factors (n,), of speed, acceleration and jerk.

    reach (n,): metres on either side of which the rows say what the controller makes of it.
    """

    s: Floats
    reach: Floats
    speed: Floats
    acceleration: Floats
    jerk: Floats


Measure = Callable[[Run, Floats], Over]
"""Says where a law exceeds, looked for between stations (2, m)."""
