"""STRATEGIES: the strategies by the names that job files use. Waypoints, order and links are the same for all."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError, nearest
from pentapod.base.keys import check_size
from pentapod.base.progress import Progress, silent
from pentapod.base.registry import Registry
from pentapod.cutters.bull_nose import BullNose
from pentapod.cutters.tool import Tool
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.passes import Passes
from pentapod.toolpath.axis.steps import stepped
from pentapod.toolpath.lines.rest_lines import rest_lines
from pentapod.toolpath.lines.sharp_edges import crease_lines, uncrossed
from pentapod.toolpath.linking.assembly import assembled
from pentapod.toolpath.options import CoverOptions, PathOptions
from pentapod.toolpath.path_report import PathReport
from pentapod.toolpath.strategy import ContactPaths, Strategy
from pentapod.toolpath.surface import Surface
from pentapod.toolpath.surfaces.drive_surface import DriveSurface
from pentapod.toolpath.surfaces.options import DriveOptions, OverhangOptions
from pentapod.toolpath.surfaces.part_surface import PartSurface
from pentapod.toolpath.surfaces.rolled_surface import RolledSurface
from pentapod.toolpath.surfaces.tip_surface import TipSurface
from pentapod.toolpath.toolpath import Toolpath

_NAMES = (
    "raster",
    "cross-hatch",
    "waterline",
    "offset",
    "spiral",
    "pencil",
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


def toolpath_with_report(
    mesh: Mesh, tool: Tool, options: PathOptions, axis: Floats | None = None, progress: Progress = silent
) -> tuple[Toolpath, PathReport]:
    """Return the toolpath of the strategy that takes these options, and its report.

    axis (3,): unit, of a tool that does not turn: then a bull-nose or flat end rolls over the part as a ball does. None
    for axes along the surface's normals. Where a cutter rolls over the part they may turn by more than `axis_step` from
    one waypoint to the next: `stepped` divides such turns.

    Raises ToolpathError if nothing is left to machine, if the options do not suit part or tool, or if a length is much
    larger than the part, as one in millimetres would be.

    >>> toolpath, report = toolpath_with_report(part, tool, RasterOptions(stepover=15e-3))
    >>> print(str(report).partition(",")[0])
    raster: 5 passes
    """
    strategy = strategy_of(options)
    check_size(options, float(np.ptp(mesh.bounds, axis=0).max()), ToolpathError)
    progress("toolpath", 0.0, "drive surface")
    surface = surface_for(mesh, tool, options, axis)
    progress("toolpath", 0.5, "passes")
    paths = with_fills(surface, strategy.paths(surface, options), options)
    progress("toolpath", 0.9, "waypoints and links")
    toolpath, report = assembled(strategy.name, surface, tool, options, paths)
    if isinstance(surface, RolledSurface):  # its centres keep their distance exactly, whatever its axis
        return toolpath, report
    # Where the normal jumps within `closest` metres, a pass has no room for the waypoints in between.
    return stepped(toolpath, options.axis_step), report


def rolls_over(tool: Tool, options: PathOptions) -> bool:
    """Return whether a ball rolls over the part: the strategy draws on its drive surface."""
    return tool.tilt_centre > 0.0 and tool.scallop_radius == tool.tilt_centre and options.rolls


def surface_for(mesh: Mesh, tool: Tool, options: PathOptions, axis: Floats | None = None) -> Surface:
    """Return the surface on which a strategy draws: where a cutter covers a part, that on which it rolls over it.

    axis: as for `toolpath_with_report`.
    """
    if rolls_over(tool, options):
        under = options.under if isinstance(options, CoverOptions) else None
        overhangs = OverhangOptions() if under is None else OverhangOptions().leaning(under / tool.tilt_centre)
        drive = DriveOptions(overhangs=overhangs)
        return DriveSurface.of(mesh, tool.tilt_centre, options.up, drive, options.region)
    if axis is not None and isinstance(tool, BullNose) and options.rolls:
        stepover = options.stepover if isinstance(options, CoverOptions) else None
        return TipSurface.of(mesh, tool, axis, options.up, 0.25 * (stepover or np.inf))
    return PartSurface(mesh, tool, options.up)


def with_fills(surface: Surface, paths: ContactPaths, options: PathOptions) -> ContactPaths:
    """Return the paths with lines along concave corners between passes, and over what is left by all these.

    If the strategy fills gaps and a cutter rolls. What a pass beside a corner leaves in it is much higher than the
    ridge between passes. What is left by all these is known for balls alone.
    """
    if not (isinstance(surface, RolledSurface) and isinstance(options, CoverOptions) and options.fill):
        return paths
    patch = surface.patch(options.region)
    patches, creases = [patch], [crease_lines(patch, also=surface.feet(patch))]
    beside = surface.nearest_to_unreached(options.region) if isinstance(surface, DriveSurface) else None
    if beside is not None:
        patches.append(beside)
        creases.append(crease_lines(beside))
    lines = uncrossed(Passes.joined(creases), paths.passes, paths.stepover, surface.radius)
    passes = Passes.joined([paths.passes, lines])
    hides = partial(surface.hides, slack=options.chordal)
    if isinstance(surface, DriveSurface):
        shortest = options.shortest_pass(paths.stepover)
        for left in patches:
            rest = rest_lines(left, passes, surface.radius, paths.stepover, hides, surface.rising, shortest)
            passes = Passes.joined([passes, rest])
    return replace(paths, passes=passes) if len(passes) > len(paths.passes) else paths


def make_toolpath(mesh: Mesh, tool: Tool, options: PathOptions, axis: Floats | None = None) -> Toolpath:
    """Return the toolpath of `toolpath_with_report`.

    >>> toolpath = make_toolpath(part, BallCutter(3e-3), RasterOptions(stepover=15e-3))
    >>> toolpath.segments[0].kind.name
    'RAPID'
    """
    return toolpath_with_report(mesh, tool, options, axis)[0]
