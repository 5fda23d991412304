"""Curves: flat lines projected or wrapped onto a surface, to be engraved or followed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import VECTOR, Key
from pentapod.geometry.directions import tangent_frame
from pentapod.mesh.geodesic.tracing import SurfaceRays, neighbours, traced
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.closest import closest, normals_at
from pentapod.toolpath.lines.projection import SurfaceHits, SurfaceMap, below, projected, topmost_in_region
from pentapod.toolpath.options import PathOptions, check_positive
from pentapod.toolpath.strategy import ContactPaths, Order, Strategy, bounds_centre, region_patch
from pentapod.toolpath.surface import Surface


class Laying(StrEnum):
    """project: along the view, as a slide projector would. wrap: along the surface, lengths kept, as a label would."""

    PROJECT = "project"
    WRAP = "wrap"


@dataclass(frozen=True, kw_only=True, eq=False)
class CurveOptions(PathOptions):
    """Flat lines projected or wrapped onto the surface.

    lines: each (n, 2), metres, x to the right and y up as seen against the view. laying: see `Laying`. position (3,):
    on the surface or over it, seen along the view. scale: of the lines. in_order: whether the lines are cut in the
    given order.

    >>> lines = CurveOptions(lines=lettering("A", 0.01), depth=2e-4)
    """

    lines: Sequence[Floats] = ()
    laying: Annotated[Laying | str, Key("", '"project" along the region\'s direction, or "wrap" along the surface')] = (
        Laying.PROJECT
    )
    position: Annotated[
        Floats | tuple[float, float, float] | None,
        Key("mm", "position of the origin, mesh frame; the middle of the region if left out", kind=VECTOR),
    ] = None
    rotation: Annotated[float, Key("deg", "anticlockwise, as seen against the view", ge=-360.0, le=360.0)] = 0.0
    depth: Annotated[float, Key("mm", "below the surface, along the normal", ge=0.0, of_part=1.0)] = 0.0
    scale: float = 1.0
    in_order: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        lines = tuple(frozen(line, f"lines[{k}]", (None, 2)) for k, line in enumerate(self.lines))
        lines = tuple(line for line in lines if len(line) > 1)
        if not lines:
            raise ToolpathError("there is no line to lay on the surface", key="lines")
        set_frozen(self, lines=lines)
        if self.position is not None:
            set_frozen(self, position=frozen(self.position, "position", (3,)))
        check_positive("scale", self.scale)


def curve_paths(surface: Surface, options: CurveOptions) -> ContactPaths:
    """Return the lines on the surface, broken where they leave the region. Raises ToolpathError if none meets it."""
    rotation = rotation_matrix(options.rotation)
    lines = [options.scale * line @ rotation for line in options.lines]
    mapped = surface_map(surface, options, options.laying, options.position)
    mapped = below(mapped, lambda plane: np.full(len(plane), options.depth))
    wrapped = options.laying is Laying.WRAP
    passes, notes = projected(lines, mapped, options, spacing=options.spacing, wrapped=wrapped, depth=options.depth)
    if not len(passes):
        raise ToolpathError(
            "no line meets the surface",
            key="position",
            value=None if options.position is None else np.asarray(options.position).tolist(),
            expected="a position from which the lines reach the region",
        )
    order = Order.GIVEN if options.in_order else Order.SHORTEST
    return ContactPaths(passes, order=order, depth=options.depth, visible=not wrapped, notes=notes)


def rotation_matrix(angle: float) -> Floats:
    """Return the matrix (2, 2) by which rows of flat points are multiplied to turn anticlockwise, radians."""
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def surface_map(
    surface: Surface, options: PathOptions, laying: Laying | str, position: Floats | tuple[float, float, float] | None
) -> SurfaceMap:
    """Return the map from the plane of the lines to the surface. Raises ToolpathError for an empty region.

    position (3,): of the origin; the middle of the region when None. laying: "project" maps onto the topmost surface
    along the view; "wrap" follows a straightest geodesic for x, then one square to it for y, from the surface point
    under the position, seen along the view, or nearest to it.
    """
    field, x = surface.part_field, tangent_frame(options.up)[0]
    region = cache(lambda: region_patch(surface, options))
    origin = bounds_centre(region()) if position is None else frozen(position, "position", (3,))
    if laying is Laying.WRAP:
        return _wrapping(region(), origin, field.topmost(origin[None])[0], x)
    y = tangent_frame(options.up)[1]

    def project(plane: Floats) -> SurfaceHits:
        points = origin + plane[:, :1] * x + plane[:, 1:] * y
        return topmost_in_region(field, points, options, slack=1e-12)  # rounding of the coordinates

    return project


def _wrapping(patch: Patch, origin: Floats, top: Floats, x: Floats) -> SurfaceMap:
    """Return the map for wrapped lines. top (1, 3): surface over the origin (3,). x (3,): direction of the x axis."""
    facet, _, weights = closest(patch, np.where(np.isfinite(top).all(), top, origin[None]))
    beside = neighbours(patch)
    normal = patch.facet_normals[facet[0]]
    x = x - (x @ normal) * normal
    x = x / np.linalg.norm(x)

    def wrap(plane: Floats) -> SurfaceHits:
        count = len(plane)
        ahead = np.where(plane[:, :1] < 0.0, -1.0, 1.0)
        rays = SurfaceRays(
            np.repeat(facet, count), np.repeat(weights, count, axis=0), ahead * x, np.ones(count, np.bool_)
        )
        rays = traced(patch, beside, rays, np.abs(plane[:, 0]))
        forward = rays.directions * ahead
        left = np.cross(patch.facet_normals[rays.facets], forward)
        up = np.where(plane[:, 1:] < 0.0, -left, left)
        rays = traced(patch, beside, SurfaceRays(rays.facets, rays.weights, up, rays.landed), np.abs(plane[:, 1]))
        return rays.points(patch), normals_at(patch, rays.facets, rays.weights), rays.landed

    return wrap


STRATEGY = Strategy("curves", CurveOptions, curve_paths, in_jobs=False)
