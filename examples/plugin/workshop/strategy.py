"""A strategy: parallel plane slices along the diagonal of the part as seen from above."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from pentapod import RasterOptions
from pentapod.base.keys import Key
from pentapod.toolpath.strategies.raster import raster_paths
from pentapod.toolpath.strategy import ContactPaths, Strategy
from pentapod.toolpath.surface import Surface


@dataclass(frozen=True, kw_only=True, eq=False)
class DiagonalOptions(RasterOptions):
    """turn: radians from the diagonal; in a job file `turn_deg`."""

    turn: Annotated[float, Key("deg", "of the passes against the part's diagonal", ge=-90.0, le=90.0)] = 0.0


def diagonal_paths(surface: Surface, options: DiagonalOptions) -> ContactPaths:
    """Return the passes of a raster along the diagonal."""
    low, high = surface.part.bounds
    diagonal = float(np.arctan2(high[1] - low[1], high[0] - low[0]))
    return raster_paths(surface, replace(options, direction=diagonal + options.turn))


STRATEGY = Strategy("diagonal", DiagonalOptions, diagonal_paths)
