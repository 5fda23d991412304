"""Strategy: how a surface is machined; ContactPaths: the lines on the surface that a strategy makes.

Each strategy is a file in `strategies/`. Waypoints, order and links are the same for all (`linking/assembly.py`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from pentapod.base.arrays import Floats, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.values import Value
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.region_share import why_empty
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.surface import Surface


class Order(StrEnum):
    """Sequence of the passes.

    zigzag: to and fro, on to the next level while a pass there begins nearby. by-level: level by level. shortest: with
    little travel between passes. given: unchanged.
    """

    ZIGZAG = "zigzag"
    BY_LEVEL = "by-level"
    SHORTEST = "shortest"
    GIVEN = "given"


@dataclass(frozen=True, eq=False)
class ContactPaths:
    """Cutter-contact paths of a strategy, before waypoints and links.

    passes: lines on the surface or below it, as fine as the mesh. stepover: largest distance along the surface between
    neighbours, metres; 0 for lines that do not cover the surface. both_ways: whether a pass may be cut backwards.
    depth: largest depth of the lines below the surface, along the normal, metres. power (P,): share of full power on
    each pass, 0 to 1; None for full power. visible: the lines are known to be visible along the view. notes: sentences
    for the report. Raises ToolpathError if there is no line.
    """

    passes: Passes
    stepover: float = 0.0
    order: Order = Order.SHORTEST
    both_ways: bool = True
    depth: float = 0.0
    power: Floats | None = None
    visible: bool = False
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        set_frozen(self, order=Order(self.order))
        if not len(self.passes):
            raise ToolpathError("the strategy makes no pass", key="region", remedy="check the region and the unit")


@dataclass(frozen=True)
class Strategy(Value):
    """A strategy. paths: surface and options → `ContactPaths`.

    options: a dataclass; its fields with a `Key` are the keys of [toolpath] in job files. in_jobs: whether job files
    can ask for it.
    """

    name: str
    options: type[PathOptions]
    paths: Callable[[Surface, Any], ContactPaths]
    in_jobs: bool = True


def region_patch(surface: Surface, options: PathOptions) -> Patch:
    """Return the region of a surface. Raises ToolpathError if it is empty."""
    patch = surface.patch(options.region)
    if not len(patch.faces):
        raise empty_region(surface.part, options)
    return patch


def empty_region(mesh: Mesh, options: PathOptions, dropped: int = 0, shortest: float = 0.0) -> ToolpathError:
    """Return the error of a region in which nothing is left to machine. dropped: passes shorter than `shortest`."""
    remedy = why_empty(mesh, options.region)
    if dropped:
        remedy = f"all {dropped} passes are shorter than {1e3 * shortest:.3g} mm"
    return ToolpathError("the region holds nothing to machine", key="region", remedy=remedy)


def bounds_centre(patch: Patch) -> Floats:
    """Return the centre (3,) of a patch's bounding box, metres."""
    corners = patch.vertices[patch.faces].reshape(-1, 3)
    return 0.5 * (corners.min(axis=0) + corners.max(axis=0))
