"""How much of the limits a controller uses that joins the setpoints of a law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from pentapod.base.arrays import Floats, Ints

GOAL = 0.999
"""Share of each limit that a sampled program may use."""


@dataclass(frozen=True, eq=False)
class Use:
    """Shares (rows,) of the limits around the setpoints of a piece: of rates or feed, of accelerations, of jerks.

    reach (rows,): seconds over which a jerk at its limit changes the legs' velocities by what they are.
    """

    speed: Floats
    acceleration: Floats
    jerk: Floats
    reach: Floats

    @property
    def exceeds(self) -> bool:
        """Whether a share is above what is aimed at."""
        return bool((self.slowing > 1.0).any())

    @cached_property
    def slowing(self) -> Floats:
        """By which factor (rows,) the motion must be slower at each row to keep the goal."""
        return np.maximum(np.maximum(self.speed / GOAL, np.sqrt(self.acceleration / GOAL)), np.cbrt(self.jerk / GOAL))

    def without_edges(self, start: int, end: int) -> Use:
        """Return it with no shares in so many rows at the start and at the end."""
        rows = np.arange(len(self.speed))
        known = (rows >= start) & (rows < len(rows) - end)
        speed, acceleration, jerk = (np.where(known, y, 0.0) for y in (self.speed, self.acceleration, self.jerk))
        return Use(speed, acceleration, jerk, self.reach)

    def at(self, rows: Ints) -> Use:
        """Return the shares of some of its rows (n,)."""
        return Use(*(getattr(self, name)[rows] for name in _COLUMNS))

    @classmethod
    def joined(cls, uses: Sequence[Use]) -> Use:
        """Return the shares of one after the other."""
        return cls(*(np.concatenate([getattr(use, name) for use in uses]) for name in _COLUMNS))


_COLUMNS = tuple(field.name for field in fields(Use))
