"""Polyline: lines given point by point, taken to the surface straight down or to its nearest point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Bools, Floats, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key
from pentapod.cutters.tool import Tool
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.closest import closest, normals_at
from pentapod.mesh.query.heightfield import HeightField
from pentapod.toolpath.drawing import Drawing, Order
from pentapod.toolpath.inputs.points import read_points
from pentapod.toolpath.lines.projection import projected, sunk
from pentapod.toolpath.nothing_left import nothing_left
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.strategies.strategy import Strategy


class Towards(StrEnum):
    """view: along the view, onto what is on top. nearest: to the nearest point of the region."""

    VIEW = "view"
    NEAREST = "nearest"


@dataclass(frozen=True, kw_only=True, eq=False)
class PolylineOptions(PathOptions):
    """Lines given point by point. lines: each (n, 3), metres, workpiece frame. towards: see `Towards`."""

    lines: Annotated[
        Sequence[Floats],
        Key(
            "", "CSV file with columns x_mm, y_mm, z_mm, relative to this job file",
            name="file", kind=Path, read=read_points, needed=True,
        ),
    ] = ()  # fmt: skip
    towards: Annotated[
        Towards | str, Key("", "taken to the surface along the region's direction, or to its nearest point")
    ] = Towards.VIEW
    depth: Annotated[float, Key("mm", "below the surface, along the normal", ge=0.0, of_part=1.0)] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        lines = tuple(frozen(line, f"lines[{k}]", (None, 3)) for k, line in enumerate(self.lines))
        if not any(len(line) > 1 for line in lines):
            raise ToolpathError("there is no line to follow", key="lines")
        set_frozen(self, lines=lines)


def draw_polyline(mesh: Mesh, tool: Tool, options: PolylineOptions) -> Drawing:
    """Return the given lines on the surface, in their order. Raises ToolpathError where none meets the region."""
    del tool
    field = HeightField(mesh, options.up)
    patch = Patch.of(mesh, options.region)
    if not len(patch.faces):
        raise nothing_left(mesh, options, 0)
    low, high = options.region.bounds

    def land(points: Floats) -> tuple[Floats, Floats, Bools]:
        if options.towards is Towards.NEAREST:
            facets, found, weights = closest(patch, points)
            return found, normals_at(patch, facets, weights), np.ones(len(points), dtype=np.bool_)
        found, normals, _ = field.topmost(points)
        landed = np.asarray(np.isfinite(found).all(axis=1))
        found, normals = np.where(landed[:, None], found, 0.0), np.where(landed[:, None], normals, options.up)
        landed &= (options.region.faces(normals) >= 0.0) & ((found >= low) & (found <= high)).all(axis=1)
        return found, normals, landed

    lines = [np.asarray(line) for line in options.lines if len(line) > 1]
    landing = sunk(land, lambda points: np.full(len(points), options.depth))
    passes, notes = projected(lines, landing, options, spacing=options.spacing, wrapped=False, sink=options.depth)
    if not len(passes):
        raise ToolpathError("no line meets the surface", key="lines", remedy="check the unit and the view")
    visible = options.towards is Towards.VIEW
    return Drawing(passes, 0.0, Order.GIVEN, sink=options.depth, visible=visible, notes=notes)


STRATEGY = Strategy("polyline", PolylineOptions, draw_polyline)
