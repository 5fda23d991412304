"""Strategies by the names that job files use: each draws lines on a surface, and all are finished alike."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pentapod.base.errors import ToolpathError, nearest
from pentapod.base.values import Value
from pentapod.cutters.tool import Tool
from pentapod.mesh.mesh import Mesh
from pentapod.toolpath.drawing import Drawing
from pentapod.toolpath.linking.assembly import finished
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.path_report import PathReport
from pentapod.toolpath.strategies.cross_hatch import CrossHatchOptions, draw_cross_hatch
from pentapod.toolpath.strategies.curves import CurveOptions, draw_curves
from pentapod.toolpath.strategies.edges import EdgeOptions, draw_edges
from pentapod.toolpath.strategies.image import ImageOptions, draw_image
from pentapod.toolpath.strategies.offset import OffsetOptions, draw_offset
from pentapod.toolpath.strategies.polyline import PolylineOptions, draw_polyline
from pentapod.toolpath.strategies.raster import RasterOptions, draw_raster
from pentapod.toolpath.strategies.spiral import SpiralOptions, draw_spiral
from pentapod.toolpath.strategies.waterline import WaterlineOptions, draw_waterline
from pentapod.toolpath.toolpath import Toolpath


@dataclass(frozen=True)
class Strategy(Value):
    """A way to machine a surface. options: what it is told; draw: surface, tool and options → lines on it."""

    name: str
    options: type[PathOptions]
    draw: Callable[[Mesh, Tool, Any], Drawing]


STRATEGIES: dict[str, Strategy] = {
    strategy.name: strategy
    for strategy in (
        Strategy("raster", RasterOptions, draw_raster),
        Strategy("cross-hatch", CrossHatchOptions, draw_cross_hatch),
        Strategy("waterline", WaterlineOptions, draw_waterline),
        Strategy("offset", OffsetOptions, draw_offset),
        Strategy("spiral", SpiralOptions, draw_spiral),
        Strategy("edges", EdgeOptions, draw_edges),
        Strategy("curves", CurveOptions, draw_curves),
        Strategy("polyline", PolylineOptions, draw_polyline),
        Strategy("image", ImageOptions, draw_image),
    )
}


def strategy_of(options: PathOptions) -> Strategy:
    """Return the strategy that takes options of this type. Raises ToolpathError where none does."""
    for strategy in STRATEGIES.values():
        if type(options) is strategy.options:
            return strategy
    known = sorted(strategy.options.__name__ for strategy in STRATEGIES.values())
    name = type(options).__name__
    raise ToolpathError("no strategy takes these options", value=name, remedy=nearest(name, known))


def toolpath_with_report(mesh: Mesh, tool: Tool, options: PathOptions) -> tuple[Toolpath, PathReport]:
    """Return the toolpath of the strategy that the options are for, and what it came to.

    Raises ToolpathError where nothing is left to machine or the options do not suit part or tool.
    """
    strategy = strategy_of(options)
    return finished(strategy.name, mesh, tool, options, strategy.draw(mesh, tool, options))


def make_toolpath(mesh: Mesh, tool: Tool, options: PathOptions) -> Toolpath:
    """Return the toolpath of `toolpath_with_report`."""
    return toolpath_with_report(mesh, tool, options)[0]
