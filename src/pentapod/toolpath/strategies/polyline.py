"""Polyline: lines given point by point, projected along the view or moved to the nearest point of the surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Floats, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key
from pentapod.mesh.query.closest import closest, normals_at
from pentapod.toolpath.inputs.points import read_points
from pentapod.toolpath.lines.projection import SurfaceHits, below, projected, topmost_in_region
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.strategy import ContactPaths, Order, Strategy, region_patch
from pentapod.toolpath.surface import Surface


class Towards(StrEnum):
    """view: along the view, onto the topmost surface. nearest: to the nearest point of the region."""

    VIEW = "view"
    NEAREST = "nearest"


@dataclass(frozen=True, kw_only=True, eq=False)
class PolylineOptions(PathOptions):
    """Lines given point by point. lines: each (n, 3), metres, workpiece frame. towards: see `Towards`.

    >>> line = PolylineOptions(lines=[np.array([[-0.02, 0.0, 0.05], [0.02, 0.0, 0.05]])])
    """

    lines: Annotated[
        Sequence[Floats],
        Key(
            "", "CSV file with columns x_mm, y_mm, z_mm, relative to this job file",
            name="file", kind=Path, read=read_points, needed=True,
        ),
    ] = ()  # fmt: skip
    towards: Annotated[
        Towards | str, Key("", "projected along the region's direction, or moved to the nearest point of the region")
    ] = Towards.VIEW
    depth: Annotated[float, Key("mm", "below the surface, along the normal", ge=0.0, of_part=1.0)] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        lines = tuple(frozen(line, f"lines[{k}]", (None, 3)) for k, line in enumerate(self.lines))
        if not any(len(line) > 1 for line in lines):
            raise ToolpathError("there is no line to follow", key="lines")
        set_frozen(self, lines=lines)


def polyline_paths(surface: Surface, options: PolylineOptions) -> ContactPaths:
    """Return the given lines on the surface, in their order. Raises ToolpathError if none meets the region."""
    field, patch = surface.part_field, region_patch(surface, options)
    visible = options.towards is Towards.VIEW

    def mapped(points: Floats) -> SurfaceHits:
        if visible:
            return topmost_in_region(field, points, options)
        facets, found, weights = closest(patch, points)
        return found, normals_at(patch, facets, weights), np.ones(len(points), dtype=np.bool_)

    lines = [np.asarray(line) for line in options.lines if len(line) > 1]
    deep = below(mapped, lambda points: np.full(len(points), options.depth))
    passes, notes = projected(lines, deep, options, spacing=options.spacing, wrapped=False, depth=options.depth)
    if not len(passes):
        raise ToolpathError("no line meets the surface", key="lines", remedy="check the unit and the view")
    return ContactPaths(passes, order=Order.GIVEN, depth=options.depth, visible=visible, notes=notes)


STRATEGY = Strategy("polyline", PolylineOptions, polyline_paths)
