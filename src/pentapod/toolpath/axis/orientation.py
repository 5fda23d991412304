"""Orientation: axis mode, lead, tilt and smoothing of the nominal tool axis along passes."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.base.values import Value
from pentapod.geometry.runs import run_starts
from pentapod.toolpath.axis.modes import AxisMode, Normal, leaned
from pentapod.toolpath.axis.smoothing import rate_capped, smoothed, tangents


@dataclass(frozen=True)
class Orientation(Value):
    """How the tool stands. mode: the direction; lead, tilt: radians from it, forwards and to the left of the feed.

    smoothing: radians by which smoothing may turn an axis, 0 for none; reach: metres over which it works, along and
    across the passes. rate: most radians of turning per metre of path, None for no cap. Raises ToolpathError for
    values that make no sense.
    """

    mode: AxisMode = field(default_factory=Normal)
    lead: float = 0.0
    tilt: float = 0.0
    smoothing: float = 0.0
    reach: float = 5e-3
    rate: float | None = None

    def __post_init__(self) -> None:
        for key in ("lead", "tilt"):
            if not abs(getattr(self, key)) <= np.radians(80.0):
                raise ToolpathError("out of range", key=key, value=getattr(self, key), expected="within ±80°")
        if not (0.0 <= self.smoothing < np.pi and 0.0 < self.reach < np.inf):
            raise ToolpathError("impossible smoothing", key="smoothing", value=(self.smoothing, self.reach))
        if self.rate is not None and not 0.0 < self.rate < np.inf:
            raise ToolpathError("must be positive", key="rate", value=self.rate)

    def axes(self, runs: list[tuple[Floats, Floats]]) -> list[Floats]:
        """Return unit axes (n, 3) for each run of contacts and unit normals (n, 3), in the order and sense of travel.

        Raises ToolpathError where the mode leaves an axis open or no smoothing keeps the cap.
        """
        if not runs:
            return []
        starts = run_starts([len(contacts) for contacts, _ in runs])
        contacts, normals = (np.concatenate([run[k] for run in runs]) for k in range(2))
        axes = self.mode.axes(contacts, normals)
        if self.lead or self.tilt:
            axes = leaned(axes, tangents(contacts, starts), self.lead, self.tilt)
        axes = smoothed(contacts, axes, self.reach, self.smoothing)
        parts = [axes[a:b] for a, b in pairwise(starts)]
        if self.rate is not None:
            parts = [rate_capped(c, part, self.rate) for (c, _), part in zip(runs, parts, strict=True)]
        return parts
