"""Spiral: one line that winds over the surface, one stepover further inwards or outwards with each turn."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import VECTOR, Key
from pentapod.geometry.directions import tangent_frame
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.geodesic import seeds_along
from pentapod.mesh.query.levels import gradients
from pentapod.mesh.query.slicing import LevelSet
from pentapod.toolpath.lines.gap_filling import gap_lines
from pentapod.toolpath.lines.scallop import level_values
from pentapod.toolpath.options import CoverOptions
from pentapod.toolpath.strategies.offset import distance_field, refined_for_fronts
from pentapod.toolpath.strategy import ContactPaths, Order, Strategy, bounds_centre, region_patch
from pentapod.toolpath.surface import Surface


class Form(StrEnum):
    """offset: follows the region's border, inwards. planar: round as seen along the view, outwards."""

    OFFSET = "offset"
    PLANAR = "planar"


@dataclass(frozen=True, kw_only=True, eq=False)
class SpiralOptions(CoverOptions):
    """One line that winds over the surface.

    form: see `Form`. centre (3,): metres, workpiece frame, seen along the view; None: the point that is furthest from
    the border (offset), or the middle of the region (planar).
    """

    form: Annotated[Form | str, Key("", "following the border, or round as seen from above")] = Form.OFFSET
    centre: Annotated[
        Floats | tuple[float, float, float] | None, Key("mm", "centre of the spiral, mesh frame", kind=VECTOR)
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.centre is not None:
            set_frozen(self, centre=frozen(self.centre, "centre", (3,)))


def spiral_paths(surface: Surface, options: SpiralOptions) -> ContactPaths:
    """Return a line that winds inwards from the region's border, or outwards in circles as seen along the view.

    If the region has no holes and appears star-shaped about the centre, seen along the view, it is one line; elsewhere
    it is in pieces, and rings, which are linked. Where turns leave more than half a step, a further line fills the gap.
    Raises ToolpathError for an empty region, or one without a border.
    """
    if options.form is Form.PLANAR:
        return _planar(surface, options)
    return _offset(surface, options)


def _offset(surface: Surface, options: SpiralOptions) -> ContactPaths:
    field = distance_field(surface, options, None)
    distance = np.where(np.isfinite(field.distance), field.distance, 0.0)
    centre = field.patch.vertices[distance.argmax()] if options.centre is None else np.asarray(options.centre)
    patch, angle, turns, kept = _polar_angle(field.patch, centre, options.up)
    # One closed turn at half a step from the border, and the spiral from there inwards.
    ring = LevelSet(patch, distance, np.array([0.5]))
    deep = (distance[patch.faces] >= 0.5).all(axis=1)
    part = Patch(patch.vertices, patch.faces[deep], patch.normals[deep])
    inside = LevelSet(part, distance - 0.5 - angle, np.zeros(0), turns[deep])
    inner, inner_distance = patch.above(distance, 0.5)
    inner, angle, turns, _ = _polar_angle(inner, centre, options.up)
    spiral = LevelSet(inner, inner_distance - 0.5 - angle, np.zeros(0), turns)
    slowness = 1.0 / field.steps[kept]
    seeds = np.minimum(seeds_along(ring, slowness), seeds_along(inside, 1.0 / field.steps[kept][deep]))
    passes = Passes.joined([ring.lines(), spiral.lines(), gap_lines(patch, seeds, slowness)])
    return ContactPaths(passes, float(field.steps.max()), Order.ZIGZAG)


def _planar(surface: Surface, options: SpiralOptions) -> ContactPaths:
    whole = region_patch(surface, options)
    patch, _ = refined_for_fronts(surface, whole, options)
    centre = bounds_centre(whole) if options.centre is None else np.asarray(options.centre)
    flat = patch.vertices - centre
    flat = flat - (flat @ options.up)[:, None] * options.up
    radius = np.linalg.norm(flat, axis=1)
    corners = radius[patch.faces]
    outwards = gradients(patch, corners)
    steps = surface.steps(patch, outwards, options)
    levels = level_values(corners, np.linalg.norm(outwards, axis=1), steps)
    if len(levels) < 2:
        raise ToolpathError("the region is too small for a spiral of this stepover", key="stepover")
    # Turn k passes radius levels[k] half way round.
    turn = np.interp(radius, levels, np.arange(len(levels)) + 0.5)
    inner, outer = radius < levels[0], radius > levels[-1]
    turn[inner] = 0.5 + (radius[inner] - levels[0]) / (levels[1] - levels[0])
    turn[outer] = len(levels) - 0.5 + (radius[outer] - levels[-1]) / (levels[-1] - levels[-2])
    patch, angle, turns, kept = _polar_angle(patch, centre, options.up)
    spiral = LevelSet(patch, turn - angle, np.zeros(0), turns)
    slowness = 1.0 / steps[kept]
    passes = Passes.joined([spiral.lines(), gap_lines(patch, seeds_along(spiral, slowness), slowness)])
    return ContactPaths(passes, float(steps.max()), Order.ZIGZAG)


def _polar_angle(patch: Patch, centre: Floats, view: Floats) -> tuple[Patch, Floats, Ints, Bools]:
    """Return the polar angle of vertices about a centre (3,), seen along the view, and how it continues on facets.

    The patch without the facets that hold the centre; the angle (V,) in turns, 0 to 1; the whole turns (F, 3) to
    subtract at the corners of a facet so that the angle is continuous there; which facets (F,) of the patch are kept.
    """
    x, y = tangent_frame(view)
    offset = patch.vertices - centre
    angle = np.mod(np.arctan2(offset @ y, offset @ x) / (2.0 * np.pi), 1.0)
    corners = angle[patch.faces]
    turns = np.rint(corners - corners[:, :1]).astype(np.intp)
    kept = np.ptp(corners - turns, axis=1) < 0.5
    return Patch(patch.vertices, patch.faces[kept], patch.normals[kept]), angle, turns[kept], kept


STRATEGY = Strategy("spiral", SpiralOptions, spiral_paths)
