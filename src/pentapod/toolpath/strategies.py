"""Strategies by the names that job files use."""

from __future__ import annotations

from collections.abc import Callable

from pentapod.toolpath.mesh import Mesh
from pentapod.toolpath.options import RasterOptions
from pentapod.toolpath.raster import RasterReport, raster_with_report
from pentapod.toolpath.toolpath import Toolpath
from pentapod.toolpath.tools import Tool

Strategy = Callable[[Mesh, Tool, RasterOptions], tuple[Toolpath, RasterReport]]
"""A surface, a tool and options → the toolpath and what it came to."""

STRATEGIES: dict[str, Strategy] = {"raster": raster_with_report}
