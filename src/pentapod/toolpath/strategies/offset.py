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
from pentapod.mesh.geodesic.distance import GeodesicField, Sources
from pentapod.mesh.geodesic.places import PatchOn
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.closest import closest, normals_at
from pentapod.mesh.query.levels import gradients
from pentapod.mesh.query.slicing import LevelSet, QuantityInside
from pentapod.toolpath.inputs.points import read_points
from pentapod.toolpath.lines.gap_filling import FRONTS, gap_lines, lines_as_sources, slowness_of
from pentapod.toolpath.options import CoverOptions
from pentapod.toolpath.strategy import ContactPaths, Order, Strategy, region_patch
from pentapod.toolpath.surface import Surface


@dataclass(frozen=True, kw_only=True, eq=False)
class OffsetOptions(CoverOptions):
    """Lines at a constant geodesic distance from each other.

    curve (n, 3): metres, workpiece frame, on the surface or near it; the region's border when None.

    >>> rings = OffsetOptions(stepover=10e-3)
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
    """Geodesic distance from a source over the region, in steps.

    drawn: the region in small facets. steps (F,): stepover on each, metres. distance (V,): of each vertex. inside: of
    places inside the facets. curve: the source on the facets, if it is not the region's border; on_curve: as a line.
    """

    drawn: PatchOn
    steps: Floats
    distance: Floats
    inside: QuantityInside
    curve: Sources | None
    on_curve: Passes


def offset_paths(surface: Surface, options: OffsetOptions) -> ContactPaths:
    """Return lines half a step from the border, or the curve itself, and then a step apart along the surface.

    Where fronts meet and leave more than half a step, a further line fills the gap. Raises ToolpathError for an empty
    region, one without a border, or a scallop that does not suit the tool.
    """
    field = distance_field(surface, options, options.curve)
    patch, reached = field.drawn.patch, np.isfinite(field.distance)
    first = 0.5 if options.curve is None else 1.0
    furthest = float(field.distance[reached].max())
    levels: Floats = np.arange(first, max(furthest, first) + 0.5, 1.0)
    distance = np.where(reached, field.distance, float(levels[-1]) + 1.0)
    level_set = LevelSet(patch, distance, levels, inside=field.inside)
    shortest = options.shortest_pass(float(field.steps.max()))
    cuts = lines_as_sources(level_set, field.steps, shortest=shortest)
    lines = [cuts, *([] if field.curve is None else [field.curve])]
    passes = Passes.joined([field.on_curve, level_set.lines(), gap_lines(patch, Sources.joined(lines), field.steps)])
    missed = 1.0 - float(patch.areas[reached[patch.faces].all(axis=1)].sum() / patch.areas.sum())
    note = f"{100.0 * missed:.2g} % of the region is not connected to the source and left out"
    return ContactPaths(passes, float(field.steps.max()), Order.ZIGZAG, notes=(note,) if missed > 1e-9 else ())


def refined_for_fronts(surface: Surface, patch: Patch, options: CoverOptions) -> tuple[PatchOn, float]:
    """Return a patch in facets that are small compared with the stepover, and the length of their edges, metres."""
    sides = patch.vertices[patch.faces[:, 1]] - patch.vertices[patch.faces[:, 0]]
    edge = FRONTS.longest_edge(surface.steps(patch, sides, options))
    return PatchOn.of(patch, lambda whole: whole.refined(edge)), edge


def distance_field(
    surface: Surface, options: CoverOptions, curve: Floats | None, points_per_edge: float = 8.0
) -> DistanceField:
    """Return the distance in steps from the region's border, or from a curve (n, 3), over the region.

    For a scallop, the steps follow from the curvature in the direction of growing distance. points_per_edge: of the
    curve in the length of a facet's edge. Raises ToolpathError for an empty region, or one without a border.
    """
    region = region_patch(surface, options)
    drawn, edge = refined_for_fronts(surface, region, options)
    patch, from_curve, line = drawn.patch, None, Passes.of([])
    if curve is not None:
        from_curve, line = _on_surface(patch, spaced(curve, edge / points_per_edge))
    elif not (region.topology.facets_at_edge == 1).any():
        raise ToolpathError("the region has no border to start from, and no curve is given", key="curve")
    if options.stepover is not None:
        # Over the region's own facets: distances are exact inside them, and there are fewer.
        field = _distance(region, None if from_curve is None else from_curve.placed(drawn), 1.0 / options.stepover)
        at_vertices, inside = drawn.at_vertices(field.at), drawn.carried(field.at)
        steps = np.full(len(patch.faces), options.stepover)
        return DistanceField(drawn, steps, at_vertices, inside, from_curve, line)
    metres = _distance(patch, from_curve, 1.0).values
    growing = gradients(patch, np.where(np.isfinite(metres), metres, 0.0)[patch.faces])
    steps = surface.steps(patch, growing, options)
    field = _distance(patch, from_curve, slowness_of(patch, steps))
    return DistanceField(drawn, steps, field.values, field.at, from_curve, line)


def _distance(patch: Patch, curve: Sources | None, slowness: Floats | float) -> GeodesicField:
    """Return the distance from a curve on a patch, or from the patch's border."""
    border = Sources.sides(patch, patch.topology.facets_at_edge == 1)
    return GeodesicField.of(patch, border if curve is None else curve, slowness)


def _on_surface(patch: Patch, points: Floats) -> tuple[Sources, Passes]:
    """Return a curve of closely spaced points (N, 3) on a patch, as the source of distances and as a pass."""
    facets, on, weights = closest(patch, points)
    inside = np.flatnonzero(facets[1:] == facets[:-1])
    alone = np.setdiff1d(np.arange(len(facets)), np.concatenate([inside, inside + 1]))
    begins, ends = np.concatenate([inside, alone]), np.concatenate([inside + 1, alone])
    line = Passes.of([(on, normals_at(patch, facets, weights))])
    return Sources(facets[begins], weights[begins], weights[ends]), line


STRATEGY = Strategy("offset", OffsetOptions, offset_paths)
