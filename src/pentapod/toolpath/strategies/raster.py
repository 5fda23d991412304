"""Raster: parallel plane slices of a surface, to and fro, one way, uphill or downhill; waterlines on steep areas."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key
from pentapod.geometry.directions import tangent_frame
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.slicing import LevelSet
from pentapod.numerics.threads import both
from pentapod.toolpath.lines.gap_filling import FRONTS, GapOptions, gap_lines, lines_as_sources
from pentapod.toolpath.lines.scallop import level_values
from pentapod.toolpath.lines.steep_areas import steep_facets
from pentapod.toolpath.options import CoverOptions
from pentapod.toolpath.strategy import ContactPaths, Order, Strategy, region_patch
from pentapod.toolpath.surface import Surface

MOST_CROSSINGS = 30_000_000
"""Largest number of crossings of planes with facets: what memory and time allow."""


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

    direction: of the passes, about the view, from its x axis towards its y axis. For the view +z these are x and y; for
    other views see `geometry.tangent_frame`. pattern: see `Pattern`. steep: areas whose normals are farther from the
    view, radians, are cut in waterlines in place of the passes, which lie beside each other or leave gaps there; None
    for none.

    >>> passes = RasterOptions(stepover=15e-3, direction=np.radians(45))
    >>> len(make_toolpath(part, tool, passes)) > 50
    True
    """

    direction: Annotated[float, Key("deg", "direction of the passes, from +x towards +y", ge=-360.0, le=360.0)] = 0.0
    pattern: Annotated[Pattern | str, Key("", "cut both ways, one way, or only where passes rise or fall")] = (
        Pattern.ZIGZAG
    )
    steep: Annotated[
        float | None,
        Key("deg", "steeper areas are machined in waterlines; none when left out", gt=0.0, lt=90.0),
    ] = None


def raster_paths(surface: Surface, options: RasterOptions) -> ContactPaths:
    """Return parallel passes over the region of a mesh.

    The passes lie in planes along the view, closer together where the surface is steep across them, so that the
    stepover along the surface is nowhere exceeded. The first and last lie half a step inside the region. Steep areas
    may have waterlines instead: see `with_waterlines`. Raises ToolpathError for an empty region, a scallop that does
    not suit the tool, or passes that are too dense.
    """
    return with_waterlines(surface, options, lambda patch: parallel_paths(surface, patch, options))


def with_waterlines(surface: Surface, options: RasterOptions, paths: Callable[[Patch], ContactPaths]) -> ContactPaths:
    """Return the paths over the region, with waterlines in place of them on areas steeper than `options.steep`.

    The waterlines come last. Raises as `raster_paths`.
    """
    whole = region_patch(surface, options)
    if options.steep is None:
        return paths(whole)
    narrow = float(surface.steps(whole, options.up, options).max())
    steep = steep_facets(whole, options.up, options.steep, narrow)
    if not steep.any():
        return paths(whole)
    share, degrees = float(whole.areas[steep].sum() / whole.areas.sum()), np.degrees(options.steep)
    notes = (f"{100.0 * share:.2g} % of the region is steeper than {degrees:.3g} deg: waterlines there",)

    def waterlines() -> tuple[Passes, float]:
        return plane_lines(surface, whole.only(steep), options, options.up)

    if steep.all():
        return ContactPaths(*waterlines(), Order.ZIGZAG, notes=notes)
    first, (lines, stepover) = both(lambda: paths(whole.only(~steep)), waterlines)
    # An empty level between both: the waterlines do not continue the last pass.
    lines = replace(lines, levels=lines.levels + int(first.passes.levels.max()) + 2)
    passes = Passes.joined([first.passes, lines])
    return replace(first, passes=passes, stepover=max(first.stepover, stepover), notes=(*first.notes, *notes))


def parallel_paths(surface: Surface, patch: Patch, options: RasterOptions) -> ContactPaths:
    """Return parallel passes over a patch. Raises as `raster_paths`."""
    x, y = tangent_frame(options.up)
    along = math.cos(options.direction) * x + math.sin(options.direction) * y
    passes, stepover = plane_lines(surface, patch, options, np.cross(options.up, along))
    if options.pattern is Pattern.ZIGZAG:
        return ContactPaths(passes, stepover, Order.ZIGZAG)
    if options.pattern is not Pattern.ONE_WAY:
        passes = _monotone(passes, options.up, upwards=options.pattern is Pattern.UPHILL, least=options.chordal)
    return ContactPaths(passes, stepover, Order.BY_LEVEL, both_ways=False)


def plane_lines(surface: Surface, patch: Patch, options: CoverOptions, across: Floats) -> tuple[Passes, float]:
    """Return the slices of a patch by planes across a direction (3,), with gaps filled, and the largest stepover."""
    heights = patch.vertices @ across
    steps = surface.steps(patch, across, options)
    slope = np.sqrt(np.maximum(1.0 - (patch.facet_normals @ across) ** 2, 0.0))
    levels = level_values(heights[patch.faces], slope, steps)
    level_set = LevelSet(patch, heights, levels)
    if level_set.crossings > MOST_CROSSINGS:
        raise ToolpathError(
            "the passes are too dense for this mesh",
            key="stepover" if options.scallop is None else "scallop",
            value=options.stepover if options.scallop is None else options.scallop,
            expected=f"at most {MOST_CROSSINGS:,} crossings of passes with facets",
            remedy="is the unit of the mesh right? If it is, take a larger stepover",
        )
    passes = level_set.lines()
    if options.fill:
        passes = Passes.joined([passes, _gaps(surface, patch, steps, options, across, levels)])
    return passes, float(steps.max())


def _gaps(
    surface: Surface, whole: Patch, steps: Floats, options: CoverOptions, across: Floats, levels: Floats
) -> Passes:
    """Return lines that fill the gaps between planes at levels (L,).

    For a ball gaps are filled near borders and creases, and the rest of walls along the planes by `rest_lines`; for
    ends all gaps are filled here.
    """
    gaps, wanted = GapOptions(), None
    if surface.turns:
        patch, wanted = whole.rim(1.25 * float(steps.max()), gaps.longest_edge(steps))
    else:
        patch, gaps = whole.refined(gaps.longest_edge(steps)), replace(gaps, negligible=FRONTS.negligible)
    if not len(patch.faces):
        return Passes.of([])
    steps = surface.steps(patch, across, options)
    sources = lines_as_sources(LevelSet(patch, patch.vertices @ across, levels), steps)
    return gap_lines(patch, sources, steps, gaps, where=wanted, area=float(whole.areas.sum()))


def _monotone(passes: Passes, view: Floats, *, upwards: bool, least: float) -> Passes:
    """Return passes that only rise along view (3,), or only fall: split at ridges and valleys, reversed where needed.

    Rises and falls of less than `least` metres are taken for noise of the mesh.
    """
    pieces: list[tuple[Floats, Floats]] = []
    levels: list[int] = []
    for k, level in enumerate(passes.levels):
        points, normals = passes.points[passes.rows(k)], passes.normals[passes.rows(k)]
        height = points @ view
        for a, b in pairwise(_turning_points(height, least)):
            step = 1 if (height[b] >= height[a]) == upwards else -1
            pieces.append((points[a : b + 1][::step], normals[a : b + 1][::step]))
            levels.append(int(level))
    return Passes.of(pieces, np.array(levels, dtype=np.intp))


def _turning_points(height: Floats, least: float) -> list[int]:
    """Return the indices of both ends and of the extrema between which height (n,) changes by more than `least`."""
    rise = np.sign(np.diff(height))
    extrema = np.flatnonzero(rise[1:] != rise[:-1]) + 1
    last = len(height) - 1
    found, sense = [0], 0
    for k in [*extrema.tolist(), last]:
        change = height[k] - height[found[-1]]
        if sense and change * sense >= 0.0:
            found[-1] = k
        elif abs(change) > least:
            found.append(k)
            sense = 1 if change > 0.0 else -1
    return [0, *found[1:-1], last]


STRATEGY = Strategy("raster", RasterOptions, raster_paths)
