"""Linear rows of a jerk-limited law at any stations, and the places where its setpoints exceed the limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.timing.limits.limit import share_of_room


@dataclass(frozen=True, eq=False)
class JerkRows:
    """What limits a law at gridpoints (N,): |first u + second x + offset| ≤ 1, |jerks (x, x′, x″)| √x ≤ 1, x ≤ ceiling.

    first, second (N, R); offset (N, R) or (1, R); jerks (N, K, 3): q‴, 1.5 q″ and 0.5 q′ over the limit; ceiling (N,).
    """

    first: Floats
    second: Floats
    offset: Floats
    jerks: Floats
    ceiling: Floats

    def pushes(self, v: Floats) -> Floats:
        """Return the largest share (N,) of an acceleration limit that x, x′, x″ (N, 3) use, beside the offset."""
        return share_of_room(self.first * (0.5 * v[:, 1:2]) + self.second * v[:, :1], self.offset).max(axis=1)

    def jerk_uses(self, v: Floats) -> Floats:
        """Return the largest share (N,) of a jerk limit that x, x′, x″ (N, 3) use."""
        return np.abs(np.einsum("nkd,nd->nk", self.jerks, v)).max(axis=1) * np.sqrt(np.maximum(v[:, 0], 0.0))


_NONE = np.zeros((0, 0))
NO_ROWS = JerkRows(_NONE, _NONE, _NONE, np.zeros((0, 0, 3)), np.zeros(0))
ROW_NAMES = tuple(field.name for field in fields(JerkRows))


class RowsAt(Protocol):
    """Gives the rows at sorted stations (N,)."""

    def __call__(self, s: Floats) -> JerkRows: ...  # noqa: D102


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
