"""Offset: lines at a constant geodesic distance from each other, from the region's border or from a curve."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key
from pentapod.geometry.polyline import spaced
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.closest import closest
from pentapod.mesh.query.geodesic import border_vertices, distances, seeds_along, seeds_at
from pentapod.mesh.query.levels import gradients
from pentapod.mesh.query.slicing import LevelSet
from pentapod.toolpath.inputs.points import read_points
from pentapod.toolpath.lines.gap_filling import FRONTS, gap_lines
from pentapod.toolpath.options import CoverOptions
from pentapod.toolpath.strategy import ContactPaths, Order, Strategy, region_patch
from pentapod.toolpath.surface import Surface


@dataclass(frozen=True, kw_only=True, eq=False)
class OffsetOptions(CoverOptions):
    """Lines at a constant geodesic distance from each other.

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
class DistanceField:
    """Geodesic distance from a source over the region, in small facets.

    steps (F,): stepover on each facet, metres. distance (V,): of each vertex from the source, in steps.
    """

    patch: Patch
    steps: Floats
    distance: Floats


def offset_paths(surface: Surface, options: OffsetOptions) -> ContactPaths:
    """Return lines half a step from the border, or on the curve, and then a step apart along the surface.

    Where fronts meet and leave more than half a step, a further line fills the gap. Raises ToolpathError for an empty
    region, one without a border, or a scallop that does not suit the tool.
    """
    field = distance_field(surface, options, options.curve)
    patch, slowness = field.patch, 1.0 / field.steps
    first = 0.5 if options.curve is None else 0.0
    reached = np.isfinite(field.distance)
    levels: Floats = np.arange(first, max(float(field.distance[reached].max()), first) + 0.5, 1.0)
    if options.curve is not None:
        levels[0] = 1e-3  # steps: just beside the curve, which is not a level line itself
    level_set = LevelSet(patch, np.where(reached, field.distance, float(levels[-1]) + 1.0), levels)
    passes = Passes.joined([level_set.lines(), gap_lines(patch, seeds_along(level_set, slowness), slowness)])
    missed = 1.0 - float(patch.areas[reached[patch.faces].all(axis=1)].sum() / patch.areas.sum())
    note = f"{100.0 * missed:.2g} % of the region is not connected to the source and left out"
    return ContactPaths(passes, float(field.steps.max()), Order.ZIGZAG, notes=(note,) if missed > 1e-9 else ())


def refined_for_fronts(surface: Surface, patch: Patch, options: CoverOptions) -> tuple[Patch, float]:
    """Return a patch in facets that are small compared with the stepover, and the length of their edges, metres."""
    sides = patch.vertices[patch.faces[:, 1]] - patch.vertices[patch.faces[:, 0]]
    edge = FRONTS.longest_edge(surface.steps(patch, sides, options))
    return patch.refined(edge), edge


def distance_field(
    surface: Surface, options: CoverOptions, curve: Floats | None, points_per_edge: float = 8.0
) -> DistanceField:
    """Return the distance in steps from the region's border, or from a curve (n, 3), over the region.

    For a scallop, the steps follow from the curvature in the direction of growing distance. points_per_edge: of the
    curve in the length of a facet's edge. Raises ToolpathError for an empty region, or one without a border.
    """
    patch, edge = refined_for_fronts(surface, region_patch(surface, options), options)
    metre = np.ones(len(patch.faces))
    facets, points = np.zeros(0, dtype=np.intp), np.zeros((0, 3))
    if curve is None:
        border = border_vertices(patch)
        if not border.any():
            raise ToolpathError(
                "the region has no border to start from", key="curve", remedy="give a curve, or a smaller region"
            )
        seeds = np.where(border, 0.0, np.inf)
    else:
        facets, points, _ = closest(patch, spaced(curve, edge / points_per_edge))
        seeds = seeds_at(patch, facets, points, metre)
    metres = distances(patch, seeds, metre)
    if options.stepover is not None:
        return DistanceField(patch, np.full(len(patch.faces), options.stepover), metres / options.stepover)
    growing = gradients(patch, np.where(np.isfinite(metres), metres, 0.0)[patch.faces])
    steps = surface.steps(patch, growing, options)
    if curve is not None:
        seeds = seeds_at(patch, facets, points, 1.0 / steps)
    return DistanceField(patch, steps, distances(patch, seeds, 1.0 / steps))


STRATEGY = Strategy("offset", OffsetOptions, offset_paths)
