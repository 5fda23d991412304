"""Cross-hatch: a raster, and a second one across it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from pentapod.base.keys import Key
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.toolpath.strategies.raster import RasterOptions, parallel_paths, with_waterlines
from pentapod.toolpath.strategy import ContactPaths, Strategy
from pentapod.toolpath.surface import Surface


@dataclass(frozen=True, kw_only=True, eq=False)
class CrossHatchOptions(RasterOptions):
    """Parallel plane slices, and others across them.

    >>> hatch = CrossHatchOptions(stepover=15e-3)
    """

    angle: Annotated[float, Key("deg", "angle from the first passes to the second", ge=-360.0, le=360.0)] = float(
        np.radians(90.0)
    )


def cross_hatch_paths(surface: Surface, options: CrossHatchOptions) -> ContactPaths:
    """Return the passes of a raster along `direction`, then those of one turned by `angle`. Raises as a raster."""
    return with_waterlines(surface, options, lambda patch: _crossed(surface, patch, options))


def _crossed(surface: Surface, patch: Patch, options: CrossHatchOptions) -> ContactPaths:
    first = parallel_paths(surface, patch, options)
    second = parallel_paths(surface, patch, replace(options, direction=options.direction + options.angle)).passes
    # An empty level between both: the second raster does not continue the last pass of the first.
    gap = int(first.passes.levels.max()) + 2
    second = replace(second, levels=second.levels + gap)
    return replace(first, passes=Passes.joined([first.passes, second]))


STRATEGY = Strategy("cross-hatch", CrossHatchOptions, cross_hatch_paths)
