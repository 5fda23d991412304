"""Offset: lines a constant distance apart over the surface itself, from the region's border or from a curve."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key
from pentapod.cutters.tool import Tool
from pentapod.geometry.polyline import spaced
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.closest import closest
from pentapod.mesh.query.geodesic import border_vertices, distances, seeds_along, seeds_at
from pentapod.mesh.query.levels import gradients
from pentapod.mesh.query.slicing import LevelSet
from pentapod.toolpath.drawing import Drawing, Order
from pentapod.toolpath.inputs.points import read_points
from pentapod.toolpath.lines.gap_filling import FACETS_PER_FRONT, edge_for, gaps_filled
from pentapod.toolpath.lines.scallop import surface_steps
from pentapod.toolpath.nothing_left import nothing_left
from pentapod.toolpath.options import CoverOptions
from pentapod.toolpath.strategies.strategy import Strategy

_CURVE_POINTS_PER_EDGE = 8.0


@dataclass(frozen=True, kw_only=True, eq=False)
class OffsetOptions(CoverOptions):
    """Lines a constant distance apart over the surface.

    curve (n, 3): metres, workpiece frame, on the surface or near it; the region's border when None.
    """

    curve: Annotated[
        Floats | None,
        Key(
            "", "CSV file of a polyline to start from; the region's border if left out",
            kind=Path, read=lambda file: read_points(file)[0],
        ),
    ] = None  # fmt: skip

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.curve is not None:
            set_frozen(self, curve=frozen(self.curve, "curve", (None, 3)))
            if len(self.curve) < 2:
                raise ToolpathError("a curve needs at least two points", key="curve", value=len(self.curve))


@dataclass(frozen=True, eq=False)
class Contours:
    """The region in small facets, and how many steps each vertex is from the source.

    steps (F,): how far apart lines may be on each facet, metres. away (V,): distance from the source in steps.
    """

    patch: Patch
    steps: Floats
    away: Floats


def draw_offset(mesh: Mesh, tool: Tool, options: OffsetOptions) -> Drawing:
    """Return lines half a step from the border, or on the curve, and then a step apart along the surface.

    Where fronts meet and leave more than half a step, a further line fills the gap. Raises ToolpathError where
    nothing is there to machine, the region has no border, or the scallop does not suit the tool.
    """
    contours = contours_of(mesh, tool, options, options.curve)
    patch, away = contours.patch, contours.away
    first = 0.5 if options.curve is None else 0.0
    reached = np.isfinite(away)
    levels: Floats = np.arange(first, max(float(away[reached].max()), first) + 0.5, 1.0)
    if options.curve is not None:
        # The curve itself is no line between vertices; one a hair's breadth beside it stands for it.
        levels[0] = 1e-3
    beyond = float(levels[-1]) + 1.0
    level_set = LevelSet(patch, np.where(reached, away, beyond), levels)
    seeds = seeds_along(level_set, 1.0 / contours.steps)
    passes = gaps_filled(patch, contours.steps, seeds, [level_set.lines()])
    left = 1.0 - float(patch.areas[reached[patch.faces].all(axis=1)].sum() / patch.areas.sum())
    notes = (f"{100.0 * left:.2g} % of the region is not connected to the source and left out",) if left > 1e-9 else ()
    return Drawing(passes, float(contours.steps.max()), Order.ZIGZAG, notes=notes)


def contours_of(mesh: Mesh, tool: Tool, options: CoverOptions, curve: Floats | None) -> Contours:
    """Return the distance in steps from the region's border, or from a curve, over the region.

    With a scallop the steps follow from the curvature along the way away from the source. Raises ToolpathError
    where the region is empty, or has no border.
    """
    whole = Patch.of(mesh, options.region)
    if not len(whole.faces):
        raise nothing_left(mesh, options, 0)
    rough = surface_steps(whole, tool, whole.vertices[whole.faces[:, 1]] - whole.vertices[whole.faces[:, 0]],
                          options.stepover, options.scallop)  # fmt: skip
    patch = whole.refined(edge_for(rough, FACETS_PER_FRONT))
    ones = np.ones(len(patch.faces))
    facets, points = np.zeros(0, dtype=np.intp), np.zeros((0, 3))
    if curve is None:
        border = border_vertices(patch)
        if not border.any():
            raise ToolpathError(
                "the region has no border to start from", key="curve", remedy="give a curve, or a smaller region"
            )
        seeds = np.where(border, 0.0, np.inf)
    else:
        fine = spaced(curve, edge_for(rough, FACETS_PER_FRONT) / _CURVE_POINTS_PER_EDGE)
        facets, points, _ = closest(patch, fine)
        seeds = seeds_at(patch, facets, points, ones)
    metres = distances(patch, seeds, ones)
    if options.scallop is None:
        steps = np.full(len(patch.faces), float(options.stepover or 0.0))
        return Contours(patch, steps, metres / steps[0])
    ways = gradients(patch, np.where(np.isfinite(metres), metres, 0.0)[patch.faces])
    steps = surface_steps(patch, tool, ways, None, options.scallop)
    slowness = 1.0 / steps
    if curve is not None:
        seeds = seeds_at(patch, facets, points, slowness)
    return Contours(patch, steps, distances(patch, seeds, slowness))


STRATEGY = Strategy("offset", OffsetOptions, draw_offset)
