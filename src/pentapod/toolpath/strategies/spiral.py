"""Spiral: one line that winds over the surface, a step closer to the middle with each turn."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import VECTOR, Key
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import tangent_frame
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.geodesic import seeds_along
from pentapod.mesh.query.levels import gradients, spread
from pentapod.mesh.query.slicing import LevelSet
from pentapod.toolpath.drawing import Drawing, Order
from pentapod.toolpath.lines.gap_filling import FACETS_PER_FRONT, edge_for, gaps_filled
from pentapod.toolpath.lines.scallop import surface_steps
from pentapod.toolpath.nothing_left import nothing_left
from pentapod.toolpath.options import CoverOptions
from pentapod.toolpath.strategies.offset import contours_of
from pentapod.toolpath.strategies.strategy import Strategy

_STEEPEST = 0.05


class Form(StrEnum):
    """offset: follows the region's border, inwards. planar: round as seen along the view, outwards."""

    OFFSET = "offset"
    PLANAR = "planar"


@dataclass(frozen=True, kw_only=True, eq=False)
class SpiralOptions(CoverOptions):
    """One line that winds over the surface.

    form: see `Form`. centre (3,): metres, workpiece frame, seen along the view; None: what is furthest from the border
    (offset), or the middle of the region (planar).
    """

    form: Annotated[Form | str, Key("", "along the border, or round from above")] = Form.OFFSET
    centre: Annotated[
        Floats | tuple[float, float, float] | None, Key("mm", "about what it winds, mesh frame", kind=VECTOR)
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.centre is not None:
            set_frozen(self, centre=frozen(self.centre, "centre", (3,)))


def draw_spiral(mesh: Mesh, tool: Tool, options: SpiralOptions) -> Drawing:
    """Return a line that winds inwards from the region's border, or outwards in circles as seen along the view.

    On a region without holes, that the view shows as a star about the centre, it is one line; elsewhere pieces of it,
    and rings, which are linked. Where turns leave more than half a step, a further line fills the gap. Raises
    ToolpathError where nothing is there to machine or the region has no border.
    """
    if options.form is Form.PLANAR:
        return _planar(mesh, tool, options)
    return _offset(mesh, tool, options)


def _offset(mesh: Mesh, tool: Tool, options: SpiralOptions) -> Drawing:
    contours = contours_of(mesh, tool, options, None)
    away = np.where(np.isfinite(contours.away), contours.away, 0.0)
    centre = contours.patch.vertices[away.argmax()] if options.centre is None else np.asarray(options.centre)
    patch, phase, turns, kept = _winding(contours.patch, centre, options.up)
    # Once round half a step from the border, and from there inwards.
    ring = LevelSet(patch, away, np.array([0.5]))
    deep = (away[patch.faces] >= 0.5).all(axis=1)
    part = Patch(patch.vertices, patch.faces[deep], patch.normals[deep])
    inside = LevelSet(part, away - 0.5 - phase, np.zeros(0), turns[deep])
    inner, inner_away = patch.above(away, 0.5)
    inner, phase, turns, _ = _winding(inner, centre, options.up)
    spiral = LevelSet(inner, inner_away - 0.5 - phase, np.zeros(0), turns)
    steps = contours.steps[kept]
    seeds = np.minimum(seeds_along(ring, 1.0 / steps), seeds_along(inside, 1.0 / steps[deep]))
    passes = gaps_filled(patch, steps, seeds, [ring.lines(), spiral.lines()])
    return Drawing(passes, float(contours.steps.max()), Order.ZIGZAG)


def _planar(mesh: Mesh, tool: Tool, options: SpiralOptions) -> Drawing:
    whole = Patch.of(mesh, options.region)
    if not len(whole.faces):
        raise nothing_left(mesh, options, 0)
    across = whole.vertices[whole.faces[:, 1]] - whole.vertices[whole.faces[:, 0]]
    patch = whole.refined(
        edge_for(surface_steps(whole, tool, across, options.stepover, options.scallop), FACETS_PER_FRONT)
    )
    corners = whole.vertices[whole.faces].reshape(-1, 3)
    centre = 0.5 * (corners.min(axis=0) + corners.max(axis=0)) if options.centre is None else np.asarray(options.centre)
    flat = patch.vertices - centre
    flat = flat - (flat @ options.up)[:, None] * options.up
    radius = np.linalg.norm(flat, axis=1)
    at = radius[patch.faces]
    ways = gradients(patch, at)
    steps = surface_steps(patch, tool, ways, options.stepover, options.scallop)
    slant = np.maximum(np.linalg.norm(ways, axis=1), _STEEPEST)
    levels = spread(at.min(axis=1), at.max(axis=1), 1.0 / (steps * slant))
    if len(levels) < 2:
        raise ToolpathError("the region is too small for a spiral of this stepover", key="stepover")
    # Turn k passes radius levels[k] half way round.
    turn = np.interp(radius, levels, np.arange(len(levels)) + 0.5)
    inner, outer = radius < levels[0], radius > levels[-1]
    turn[inner] = 0.5 + (radius[inner] - levels[0]) / (levels[1] - levels[0])
    turn[outer] = len(levels) - 0.5 + (radius[outer] - levels[-1]) / (levels[-1] - levels[-2])
    patch, phase, turns, kept = _winding(patch, centre, options.up)
    spiral = LevelSet(patch, turn - phase, np.zeros(0), turns)
    seeds = seeds_along(spiral, 1.0 / steps[kept])
    passes = gaps_filled(patch, steps[kept], seeds, [spiral.lines()])
    return Drawing(passes, float(steps.max()), Order.ZIGZAG)


def _winding(patch: Patch, centre: Floats, view: Floats) -> tuple[Patch, Floats, Ints, Bools]:
    """Return how vertices lie about a centre as seen along the view.

    The patch without the facets that hold the centre; the angle (V,) in turns, 0 to 1; the whole turns (F, 3) by
    which an angle counts less on a facet, so that it is continuous there; which facets (F,) are kept.
    """
    x, y = tangent_frame(view)
    away = patch.vertices - centre
    phase = np.mod(np.arctan2(away @ y, away @ x) / (2.0 * np.pi), 1.0)
    at = phase[patch.faces]
    turns = np.rint(at - at[:, :1]).astype(np.intp)
    smooth = at - turns
    kept = smooth.max(axis=1) - smooth.min(axis=1) < 0.5
    return Patch(patch.vertices, patch.faces[kept], patch.normals[kept]), phase, turns[kept], kept


STRATEGY = Strategy("spiral", SpiralOptions, draw_spiral)
