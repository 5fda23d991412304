"""STRATEGIES: the strategies by the names that job files use. Each draws lines on a surface; assembly is shared."""

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
from pentapod.toolpath.strategies.strategy import Strategy
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
    """Return the strategy that takes options of this type. Raises ToolpathError where none does."""
    for strategy in STRATEGIES.values():
        if type(options) is strategy.options:
            return strategy
    known = sorted(strategy.options.__name__ for strategy in STRATEGIES.values())
    name = type(options).__name__
    raise ToolpathError("no strategy takes these options", value=name, remedy=nearest(name, known))


def toolpath_with_report(mesh: Mesh, tool: Tool, options: PathOptions) -> tuple[Toolpath, PathReport]:
    """Return the toolpath of the strategy that the options are for, and what it came to.

    Raises ToolpathError where nothing is left to machine, or the options do not suit part or tool: lengths larger than
    the part, as of options in millimetres, are refused.
    """
    strategy = strategy_of(options)
    check_size(options, float(np.ptp(mesh.bounds, axis=0).max()), ToolpathError)
    return assembled(strategy.name, mesh, tool, options, strategy.draw(mesh, tool, options))


def make_toolpath(mesh: Mesh, tool: Tool, options: PathOptions) -> Toolpath:
    """Return the toolpath of `toolpath_with_report`."""
    return toolpath_with_report(mesh, tool, options)[0]
