"""Raster: parallel plane slices of a surface, to and fro, one way, uphill or downhill."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import tangent_frame
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.geodesic import seeds_along
from pentapod.mesh.query.levels import spread
from pentapod.mesh.query.slicing import LevelSet
from pentapod.toolpath.drawing import Drawing, Order
from pentapod.toolpath.lines.gap_filling import edge_for, gap_lines
from pentapod.toolpath.lines.scallop import surface_steps
from pentapod.toolpath.lines.slopes import monotone
from pentapod.toolpath.nothing_left import nothing_left
from pentapod.toolpath.options import CoverOptions
from pentapod.toolpath.strategies.strategy import Strategy

MOST_CROSSINGS = 30_000_000
STEEPEST = 0.05


class Pattern(StrEnum):
    """zigzag: cut both ways, staying down where the next pass is near. one-way: always the same way.

    uphill, downhill: every pass is cut where it rises, or falls, along the view; split at ridges and valleys.
    """

    ZIGZAG = "zigzag"
    ONE_WAY = "one-way"
    UPHILL = "uphill"
    DOWNHILL = "downhill"


@dataclass(frozen=True, kw_only=True, eq=False)
class RasterOptions(CoverOptions):
    """Parallel plane slices.

    direction: of the passes, about the view from its x axis towards its y axis; for the view +z these are x and y, for
    others they are carried along (`geometry.tangent_frame`). pattern: see `Pattern`.
    """

    direction: Annotated[float, Key("deg", "direction of the passes, from +x towards +y", ge=-360.0, le=360.0)] = 0.0
    pattern: Annotated[Pattern | str, Key("", "cut both ways, one way, or only where passes rise or fall")] = (
        Pattern.ZIGZAG
    )


def draw_raster(mesh: Mesh, tool: Tool, options: RasterOptions) -> Drawing:
    """Return parallel passes over the region of a mesh.

    The passes lie in planes along the view, closer together where the surface is steep across them, so that
    they are nowhere further apart on the surface than asked. The first and last lie half a step inside the
    region. Raises ToolpathError where nothing is there to machine, the scallop does not suit the tool, or
    the passes are so dense that there would be no end to it.
    """
    x, y = tangent_frame(options.up)
    along = math.cos(options.direction) * x + math.sin(options.direction) * y
    patch = Patch.of(mesh, options.region)
    if not len(patch.faces):
        raise nothing_left(mesh, options, 0)
    passes, stepover = plane_lines(patch, tool, options, np.cross(options.up, along))
    if options.pattern is Pattern.ZIGZAG:
        return Drawing(passes, stepover, Order.ZIGZAG)
    if options.pattern is not Pattern.ONE_WAY:
        passes = monotone(passes, options.up, upwards=options.pattern is Pattern.UPHILL, least=options.chordal)
    return Drawing(passes, stepover, Order.BY_LEVEL, both_ways=False)


def plane_lines(patch: Patch, tool: Tool, options: CoverOptions, across: Floats) -> tuple[Passes, float]:
    """Return the lines in planes across a direction (3,), as near as the options ask, and the largest stepover."""
    values = patch.vertices @ across
    corners = values[patch.faces]
    steps = surface_steps(
        patch, tool, np.broadcast_to(across, patch.facet_normals.shape), options.stepover, options.scallop
    )
    slant = np.sqrt(np.maximum(1.0 - (patch.facet_normals @ across) ** 2, STEEPEST**2))
    levels = spread(corners.min(axis=1), corners.max(axis=1), 1.0 / (steps * slant))
    level_set = LevelSet(patch, values, levels)
    if level_set.crossings > MOST_CROSSINGS:
        raise ToolpathError(
            "the passes are too dense for this mesh",
            key="stepover" if options.scallop is None else "scallop",
            value=options.stepover if options.scallop is None else options.scallop,
            expected=f"at most {MOST_CROSSINGS:,} crossings of passes with facets",
            remedy="check the unit of the mesh and the stepover",
        )
    passes = level_set.lines()
    if options.fill:
        # Between planes that go on, no gap can be: only near borders.
        gaps = _gaps(patch, steps, tool, options, across, levels)
        passes = Passes.joined([passes, gaps]) if len(gaps) else passes
    return passes, float(steps.max())


def _gaps(whole: Patch, steps: Floats, tool: Tool, options: CoverOptions, across: Floats, levels: Floats) -> Passes:
    """Return lines around what planes at levels leave more than half a step from all of them, near borders."""
    patch, near = whole.rim(1.25 * float(steps.max()), edge_for(steps))
    if not len(patch.faces):
        return Passes.of([])
    ways = np.broadcast_to(across, patch.facet_normals.shape)
    slowness = 1.0 / surface_steps(patch, tool, ways, options.stepover, options.scallop)
    seeds = seeds_along(LevelSet(patch, patch.vertices @ across, levels), slowness)
    return gap_lines(patch, seeds, slowness, where=near, area=float(whole.areas.sum()))


STRATEGY = Strategy("raster", RasterOptions, draw_raster)
