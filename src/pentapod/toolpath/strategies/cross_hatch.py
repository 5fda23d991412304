"""Cross-hatch: a raster, and a second one across it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from pentapod.base.keys import Key
from pentapod.cutters.tool import Tool
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.passes import Passes
from pentapod.toolpath.drawing import Drawing, Order
from pentapod.toolpath.strategies.raster import Pattern, RasterOptions, draw_raster
from pentapod.toolpath.strategies.strategy import Strategy


@dataclass(frozen=True, kw_only=True, eq=False)
class CrossHatchOptions(RasterOptions):
    """Parallel plane slices, and others across them."""

    angle: Annotated[float, Key("deg", "from the first passes to the second", ge=-360.0, le=360.0)] = float(
        np.radians(90.0)
    )


def draw_cross_hatch(mesh: Mesh, tool: Tool, options: CrossHatchOptions) -> Drawing:
    """Return the passes of a raster along `direction`, then those of one turned by `angle`. Raises as a raster."""
    first = draw_raster(mesh, tool, options)
    second = draw_raster(mesh, tool, replace(options, direction=options.direction + options.angle))
    # A level of its own between both keeps the first raster's last pass from being followed as a neighbour.
    gap = int(first.passes.levels.max()) + 2
    moved = Passes(second.passes.points, second.passes.normals, second.passes.starts, second.passes.levels + gap)
    passes = Passes.joined([first.passes, moved])
    order = Order.ZIGZAG if options.pattern is Pattern.ZIGZAG else Order.BY_LEVEL
    return Drawing(passes, first.stepover, order, first.both_ways)


STRATEGY = Strategy("cross-hatch", CrossHatchOptions, draw_cross_hatch)
