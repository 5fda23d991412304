"""STRATEGIES: the strategies by the names that job files use. Waypoints, order and links are the same for all."""

from __future__ import annotations

import numpy as np

from pentapod.base.errors import ToolpathError, nearest
from pentapod.base.keys import check_size
from pentapod.base.registry import Registry
from pentapod.cutters.tool import Tool
from pentapod.mesh.mesh import Mesh
from pentapod.toolpath.linking.assembly import assembled
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.path_report import PathReport
from pentapod.toolpath.strategy import Strategy
from pentapod.toolpath.toolpath import Toolpath

_NAMES = (
    "raster",
    "cross-hatch",
    "waterline",
    "offset",
    "spiral",
    "edges",
    "curves",
    "drawing",
    "text",
    "polyline",
    "image",
)
"""A new strategy is a file of this folder that ends with `STRATEGY = Strategy(...)`, and its name here."""

STRATEGIES = Registry(
    "strategy",
    "pentapod.strategies",
    Strategy,
    ToolpathError,
    homes={name: f"pentapod.toolpath.strategies.{name.replace('-', '_')}" for name in _NAMES},
    constant="STRATEGY",
)


def strategy_of(options: PathOptions) -> Strategy:
    """Return the strategy that takes options of this type. Raises ToolpathError if there is none."""
    for strategy in STRATEGIES.values():
        if type(options) is strategy.options:
            return strategy
    known = sorted(strategy.options.__name__ for strategy in STRATEGIES.values())
    name = type(options).__name__
    raise ToolpathError("no strategy takes these options", value=name, remedy=nearest(name, known))


def toolpath_with_report(mesh: Mesh, tool: Tool, options: PathOptions) -> tuple[Toolpath, PathReport]:
    """Return the toolpath of the strategy that takes these options, and its report.

    Raises ToolpathError if nothing is left to machine, if the options do not suit part or tool, or if a length is much
    larger than the part, as one in millimetres would be.
    """
    strategy = strategy_of(options)
    check_size(options, float(np.ptp(mesh.bounds, axis=0).max()), ToolpathError)
    return assembled(strategy.name, mesh, tool, options, strategy.paths(mesh, tool, options))


def make_toolpath(mesh: Mesh, tool: Tool, options: PathOptions) -> Toolpath:
    """Return the toolpath of `toolpath_with_report`."""
    return toolpath_with_report(mesh, tool, options)[0]
