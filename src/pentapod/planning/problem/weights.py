"""Weights of the groups of margins in the max-min objective."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ArrayError
from pentapod.base.values import Value
from pentapod.planning.limits.limit import Limit

NEEDED_MARGIN = 0.02
"""Smallest margin of an accepted plan; it covers the blending of corners between waypoints."""


@dataclass(frozen=True)
class Weights(Value):
    """Positive weights of leg strokes, singular surfaces, joint cones, gaps between bodies, and stiffness at the tip.

    A margin's excess over the needed one is divided by its weight: with strokes = 2 and all else 1 the strokes keep
    twice the excess of the others. Whether a part fits does not depend on the weights. Raises ArrayError for a weight
    that is not positive.

    >>> weights = Weights(strokes=2.0)
    """

    strokes: float = 1.0
    singularities: float = 1.0
    joints: float = 1.0
    bodies: float = 1.0
    stiffness: float = 1.0

    def __post_init__(self) -> None:
        for field in fields(self):
            if not 0.0 < getattr(self, field.name) < np.inf:
                raise ArrayError("a weight must be positive", key=field.name, value=getattr(self, field.name))

    @property
    def are_even(self) -> bool:
        """Whether all weights are 1."""
        return self == EVEN

    def of(self, limits: Sequence[Limit]) -> Floats:
        """Return the weight (M,) of each limit."""
        return np.array([getattr(self, limit.group) for limit in limits], dtype=np.float64)

    def plain(self, margin: float) -> float:
        """Return the plain margin that, weighed, is at least `margin` in each group."""
        if self.are_even:
            return margin
        heaviest = max(getattr(self, field.name) for field in fields(self))
        return NEEDED_MARGIN + (margin - NEEDED_MARGIN) * heaviest


EVEN = Weights()


def weighed(values: Any, weights: Any) -> Any:
    """Return margins with their excess over the needed one divided by weights; NumPy arrays or casadi columns."""
    return NEEDED_MARGIN + (values - NEEDED_MARGIN) / weights
