"""Curves: flat lines laid on a surface to be engraved or followed, projected or wrapped, with depth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Bools, Floats, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import VECTOR, Key
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import tangent_frame
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.closest import closest, normals_at
from pentapod.mesh.query.geodesic_tracing import SurfaceRays, neighbours, traced
from pentapod.mesh.query.heightfield import HeightField
from pentapod.toolpath.drawing import Drawing, Order
from pentapod.toolpath.lines.projection import Landing, projected, sunk
from pentapod.toolpath.nothing_left import nothing_left
from pentapod.toolpath.options import PathOptions, positive
from pentapod.toolpath.strategies.strategy import Strategy


class Laying(StrEnum):
    """project: along the view, as a slide projector would. wrap: along the surface, lengths kept, as a label would."""

    PROJECT = "project"
    WRAP = "wrap"


@dataclass(frozen=True, kw_only=True, eq=False)
class CurveOptions(PathOptions):
    """Flat lines laid on the surface.

    lines: each (n, 2), metres, x to the right and y up as seen against the view. laying: see `Laying`. position (3,):
    on the surface or over it, seen along the view. scale: of the lines. in_order: whether the lines are cut in their
    order.
    """

    lines: Sequence[Floats] = ()
    laying: Annotated[Laying | str, Key("", '"project" along the region\'s direction, or "wrap" along the surface')] = (
        Laying.PROJECT
    )
    position: Annotated[
        Floats | tuple[float, float, float] | None,
        Key("mm", "where the origin goes, mesh frame; the middle of the region if left out", kind=VECTOR),
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
        positive("scale", self.scale)


def draw_curves(mesh: Mesh, tool: Tool, options: CurveOptions) -> Drawing:
    """Return the lines on the surface, broken where they leave the region.

    Projected lines lie on what is on top as seen along the view. Wrapped ones keep their lengths: their x axis
    follows a straightest line from the position, y is measured along straightest lines square to it. Raises
    ToolpathError where no line meets the region.
    """
    del tool
    turn = flat_turn(options.rotation)
    lines = [options.scale * line @ turn for line in options.lines]
    landing = projection(mesh, options) if options.laying is Laying.PROJECT else wrapping(mesh, options)
    landing = sunk(landing, lambda plane: np.full(len(plane), options.depth))
    wrapped = options.laying is Laying.WRAP
    passes, notes = projected(lines, landing, options, spacing=options.spacing, wrapped=wrapped, sink=options.depth)
    if not len(passes):
        raise ToolpathError(
            "no line meets the surface",
            key="position",
            value=None if options.position is None else np.asarray(options.position).tolist(),
            expected="a position from which the lines reach the region",
        )
    return Drawing(
        passes,
        0.0,
        Order.GIVEN if options.in_order else Order.SHORTEST,
        sink=options.depth,
        visible=not wrapped,
        notes=notes,
    )


def flat_turn(angle: float) -> Floats:
    """Return the matrix (2, 2) by which rows of flat points are multiplied to turn anticlockwise, radians."""
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def origin(mesh: Mesh, options: CurveOptions) -> Floats:
    """Return the position (3,), or the middle of the region's bounds. Raises ToolpathError for an empty region."""
    if options.position is not None:
        return np.asarray(options.position)
    patch = Patch.of(mesh, options.region)
    if not len(patch.faces):
        raise nothing_left(mesh, options, 0)
    corners = patch.vertices[patch.faces].reshape(-1, 3)
    return 0.5 * (corners.min(axis=0) + corners.max(axis=0))


def projection(mesh: Mesh, options: CurveOptions) -> Landing:
    """Return what lays points of the plane on top of a mesh, seen along the view, within the region."""
    field, start = HeightField(mesh, options.up), origin(mesh, options)
    x, y = tangent_frame(options.up)
    low, high = options.region.bounds

    def land(plane: Floats) -> tuple[Floats, Floats, Bools]:
        points, normals, _ = field.topmost(start + plane[:, :1] * x + plane[:, 1:] * y)
        landed = np.asarray(np.isfinite(points).all(axis=1))
        points, normals = np.where(landed[:, None], points, 0.0), np.where(landed[:, None], normals, options.up)
        landed &= options.region.faces(normals) >= 0.0
        landed &= ((points >= low - 1e-12) & (points <= high + 1e-12)).all(axis=1)
        return points, normals, landed

    return land


def wrapping(mesh: Mesh, options: CurveOptions) -> Landing:
    """Return what lays points of the plane along the surface of the region.

    From the point of the surface under the position, seen along the view, or nearest to it, a straightest line is
    followed for x, then one square to it for y.
    """
    patch = Patch.of(mesh, options.region)
    if not len(patch.faces):
        raise nothing_left(mesh, options, 0)
    start = origin(mesh, options)
    top, _, _ = HeightField(mesh, options.up).topmost(start[None])
    facet, _, weights = closest(patch, np.where(np.isfinite(top).all(), top, start[None]))
    beside = neighbours(patch)
    normal = patch.facet_normals[facet[0]]
    x = tangent_frame(options.up)[0]
    x = x - (x @ normal) * normal
    x = x / np.linalg.norm(x)

    def land(plane: Floats) -> tuple[Floats, Floats, Bools]:
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

    return land


STRATEGY = Strategy("curves", CurveOptions, draw_curves, in_jobs=False)
