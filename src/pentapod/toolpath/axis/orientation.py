"""Orientation: axis mode, lead, tilt and smoothing of the nominal tool axis along passes."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key, check_fields
from pentapod.base.values import Value
from pentapod.geometry.runs import run_starts
from pentapod.toolpath.axis.modes import AxisMode, Normal, leaned
from pentapod.toolpath.axis.smoothing import rate_capped, smoothed, tangents


@dataclass(frozen=True)
class Orientation(Value):
    """The nominal tool axis along the passes. mode: the direction from which lead and tilt count.

    smoothing: 0 for none. rate: radians per metre, None for no cap. Raises ToolpathError for values out of range.
    """

    mode: AxisMode = field(default_factory=Normal)
    lead: Annotated[float, Key("deg", "lead angle: to the front, along the feed", ge=-80.0, le=80.0)] = 0.0
    tilt: Annotated[float, Key("deg", "side tilt: to the left of the feed", name="side", ge=-80.0, le=80.0)] = 0.0
    smoothing: Annotated[float, Key("deg", "largest angle by which smoothing may turn an axis", ge=0.0, le=45.0)] = 0.0
    reach: Annotated[
        float, Key("mm", "distance over which it works, along and across the passes", name="smoothing_reach", gt=0.0)
    ] = 5e-3
    rate: Annotated[float | None, Key("deg_mm", "largest turn of the axis per mm of a cut", gt=0.0)] = None

    def __post_init__(self) -> None:
        check_fields(self, ToolpathError)

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
