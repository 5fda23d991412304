"""Waterline: slices at constant height along any direction, for steep surfaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import VECTOR, Key
from pentapod.toolpath.options import CoverOptions, unit_vector
from pentapod.toolpath.strategies.raster import plane_lines
from pentapod.toolpath.strategy import ContactPaths, Order, Strategy, region_patch
from pentapod.toolpath.surface import Surface


@dataclass(frozen=True, kw_only=True, eq=False)
class WaterlineOptions(CoverOptions):
    """Lines of constant height.

    upright (3,): direction of the heights; the view when None. shallowest: surface that is flatter, seen along
    `upright`, is left out, because lines of constant height would be far apart there.

    >>> steep = WaterlineOptions(stepover=2e-3)
    """

    upright: Annotated[
        Floats | tuple[float, float, float] | None,
        Key("", "direction of the heights; the region's when left out", kind=VECTOR),
    ] = None
    shallowest: Annotated[float, Key("deg", "flatter surface is left out", gt=0.0, lt=90.0)] = float(np.radians(10.0))

    def __post_init__(self) -> None:
        super().__post_init__()
        set_frozen(self, upright=unit_vector("upright", self.up if self.upright is None else self.upright))


def waterline_paths(surface: Surface, options: WaterlineOptions) -> ContactPaths:
    """Return lines of constant height over the region of a mesh, where it is steep enough.

    Heights are closer together where the surface is flatter, so that the stepover along the surface is nowhere
    exceeded. Raises ToolpathError for an empty or flat region, or a scallop that does not suit the tool.
    """
    upright = np.asarray(options.upright)
    whole = region_patch(surface, options)
    patch = whole.steeper(upright, options.shallowest)
    if not len(patch.faces):
        raise ToolpathError("the region is too flat for waterlines", key="shallowest", value=options.shallowest)
    passes, stepover = plane_lines(surface, patch, options, upright)
    flat = 1.0 - float(patch.areas.sum() / whole.areas.sum())
    degrees = np.degrees(options.shallowest)
    note = f"{100.0 * flat:.2g} % of the region is flatter than {degrees:.3g} deg and left out"
    return ContactPaths(passes, stepover, Order.ZIGZAG, notes=(note,) if flat > 1e-6 else ())


STRATEGY = Strategy("waterline", WaterlineOptions, waterline_paths)
