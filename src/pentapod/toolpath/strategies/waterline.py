"""Waterline: slices at constant height along any direction, for steep surfaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import VECTOR, Key
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import normalised
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.toolpath.drawing import Drawing, Order
from pentapod.toolpath.nothing_left import nothing_left
from pentapod.toolpath.options import CoverOptions
from pentapod.toolpath.strategies.raster import plane_lines
from pentapod.toolpath.strategies.strategy import Strategy


@dataclass(frozen=True, kw_only=True, eq=False)
class WaterlineOptions(CoverOptions):
    """Lines of constant height.

    upright (3,): the view when None. Where the surface is flatter than `shallowest`, seen along `upright`, lines of
    constant height would be far apart: it is left to another strategy.
    """

    upright: Annotated[
        Floats | tuple[float, float, float] | None,
        Key("", "direction of the heights; the region's when left out", kind=VECTOR),
    ] = None
    shallowest: Annotated[float, Key("deg", "flatter surface is left out", gt=0.0, lt=90.0)] = float(np.radians(10.0))

    def __post_init__(self) -> None:
        super().__post_init__()
        upright = self.up if self.upright is None else self.upright
        if not np.linalg.norm(frozen(upright, "upright", (3,))) > 0.0:
            raise ToolpathError("the direction has no length", key="upright")
        set_frozen(self, upright=frozen(normalised(upright), "upright"))


def draw_waterline(mesh: Mesh, tool: Tool, options: WaterlineOptions) -> Drawing:
    """Return lines of constant height over the region of a mesh, where it is steep enough.

    Heights are closer together where the surface is flatter, so that the lines are nowhere further apart on
    the surface than asked. Raises ToolpathError where nothing is there to machine or the scallop does not
    suit the tool.
    """
    upright = np.asarray(options.upright)
    whole = Patch.of(mesh, options.region)
    if not len(whole.faces):
        raise nothing_left(mesh, options, 0)
    patch = whole.steeper(upright, options.shallowest)
    if not len(patch.faces):
        raise ToolpathError(
            "the region is flatter everywhere than waterlines suit",
            key="shallowest",
            value=options.shallowest,
            remedy="use a raster, or turn the direction of the heights",
        )
    passes, stepover = plane_lines(patch, tool, options, upright)
    left = 1.0 - float(patch.areas.sum() / whole.areas.sum())
    degrees = np.degrees(options.shallowest)
    notes = (
        (f"{100.0 * left:.2g} % of the region is flatter than {degrees:.3g} deg and left out",) if left > 1e-6 else ()
    )
    return Drawing(passes, stepover, Order.ZIGZAG, notes=notes)


STRATEGY = Strategy("waterline", WaterlineOptions, draw_waterline)
