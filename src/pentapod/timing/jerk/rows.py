"""Linear rows of the limits of a jerk-limited law, and where its setpoints exceed them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from pentapod.base.arrays import Floats, row_maxima
from pentapod.timing.limits.limit import share_of_room
from pentapod.timing.time_law.motion_law import SpeedNodes


@dataclass(frozen=True, eq=False)
class JerkRows:
    """Limits at gridpoints (N,): |first u + second x + offset| ≤ 1, |jerks (x, x′, x″)| √x ≤ 1, x ≤ ceiling.

    first, second (N, R); offset (N, R) or (1, R); jerks (N, K, 3): q‴, 1.5 q″ and 0.5 q′ over the limit; ceiling (N,).
    """

    first: Floats
    second: Floats
    offset: Floats
    jerks: Floats
    ceiling: Floats

    def acceleration_shares(self, v: Floats) -> Floats:
        """Return the largest share (N,) of an acceleration limit at x, x′, x″ (N, 3), beside the offset."""
        return row_maxima(share_of_room(self.first * (0.5 * v[:, 1:2]) + self.second * v[:, :1], self.offset))

    def jerk_shares(self, v: Floats) -> Floats:
        """Return the largest share (N,) of a jerk limit at x, x′, x″ (N, 3)."""
        return row_maxima(np.abs(np.einsum("nkd,nd->nk", self.jerks, v))) * np.sqrt(np.maximum(v[:, 0], 0.0))


_NONE = np.zeros((0, 0))
NO_ROWS = JerkRows(_NONE, _NONE, _NONE, np.zeros((0, 0, 3)), np.zeros(0))
ROW_NAMES = tuple(field.name for field in fields(JerkRows))

RowsAt = Callable[[Floats], JerkRows]
"""Gives the rows at sorted stations (N,)."""


@dataclass(frozen=True, eq=False)
class Excess:
    """Sorted stations (n,) where setpoints exceed limits, and by which factors (n,): speed, acceleration and jerk.

    reach (n,): metres on either side whose rows determine what the controller does there.
    """

    s: Floats
    reach: Floats
    speed: Floats
    acceleration: Floats
    jerk: Floats


MeasureExcess = Callable[[SpeedNodes, Floats], Excess]
"""Measures where the setpoints of a law exceed limits, between stations (2, m)."""
