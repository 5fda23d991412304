"""Pencil: lines along concave corners, where a ball touches both sides; clears what wider passes left there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from pentapod.base.errors import ToolpathError
from pentapod.base.keys import Key
from pentapod.toolpath.lines.sharp_edges import CreaseOptions, crease_lines
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.strategy import ContactPaths, Strategy, region_patch
from pentapod.toolpath.surface import Surface


@dataclass(frozen=True, kw_only=True, eq=False)
class PencilOptions(PathOptions):
    """Lines along the creases of a ball's drive surface. sharpest: angle between the directions to both contacts.

    >>> corners = PencilOptions(clearance=15e-3)
    """

    sharpest: Annotated[
        float, Key("deg", "angle between the sides of a corner from which it counts", gt=0.0, lt=180.0)
    ] = CreaseOptions.sharpest

    rolls: ClassVar[bool] = True


def pencil_paths(surface: Surface, options: PencilOptions) -> ContactPaths:
    """Return the lines along which a ball touches the part on two sides.

    Fillets with a radius above the ball's are no corners, and corners shorter than it are left out. Raises
    ToolpathError if there is no corner, or no ball.
    """
    if not surface.slides:
        raise ToolpathError(
            "only a ball follows concave corners", key="strategy", value="pencil", remedy="use a ball cutter"
        )
    lines = crease_lines(region_patch(surface, options), options.sharpest)
    lines = lines.where(lines.lengths >= max(options.shortest or 0.0, surface.radius))
    if not len(lines):
        given = options.sharpest != CreaseOptions.sharpest
        key, value = ("sharpest", options.sharpest) if given else ("strategy", "pencil")
        raise ToolpathError(
            "the region has no concave corner for this ball", key=key, value=value,
            expected=f"a corner that a ball touches on two sides, {np.degrees(options.sharpest):.3g} deg apart or more",
            remedy="take a larger ball, or a strategy that covers the surface",
        )  # fmt: skip
    return ContactPaths(lines)


STRATEGY = Strategy("pencil", PencilOptions, pencil_paths)
