"""Spiral: one line that winds over the surface, one stepover further inwards or outwards with each turn."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import Annotated

import numpy as np

from pentapod.base.arrays import Bools, Floats, Ints, frozen, set_frozen
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import VECTOR, Key
from pentapod.geometry.directions import tangent_frame
from pentapod.mesh.geodesic.distance import Sources
from pentapod.mesh.geodesic.places import PatchOn
from pentapod.mesh.passes import Passes
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.levels import gradients
from pentapod.mesh.query.slicing import LevelSet, QuantityInside
from pentapod.toolpath.lines.gap_filling import gap_lines, lines_as_sources
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

    >>> spiral = SpiralOptions(stepover=10e-3)
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
    finite = np.where(np.isfinite(field.distance), field.distance, 0.0)
    centre = field.drawn.patch.vertices[finite.argmax()] if options.centre is None else np.asarray(options.centre)
    # One closed turn at half a step from the border, and the spiral from there inwards.
    ring = LevelSet(field.drawn.patch, finite, np.array([0.5]), inside=field.inside)
    shortest = options.shortest_pass(float(field.steps.max()))
    cuts = partial(lines_as_sources, steps=field.steps, shortest=shortest)
    inner = PatchOn.of(field.drawn.patch, lambda patch: patch.above(finite, 0.5)[0])
    if not len(inner.patch.faces):
        gaps = gap_lines(field.drawn.patch, cuts(ring), field.steps)
        return ContactPaths(Passes.joined([ring.lines(), gaps]), float(field.steps.max()), Order.ZIGZAG)
    spiral, kept = _wound(inner, field.inside, 0.5, centre, options.up)
    sources = Sources.joined([cuts(ring), cuts(spiral).placed(inner.where(kept))])
    passes = Passes.joined([ring.lines(), spiral.lines(), gap_lines(field.drawn.patch, sources, field.steps)])
    return ContactPaths(passes, float(field.steps.max()), Order.ZIGZAG)


def _planar(surface: Surface, options: SpiralOptions) -> ContactPaths:
    whole = region_patch(surface, options)
    drawn, _ = refined_for_fronts(surface, whole, options)
    patch = drawn.patch
    centre = bounds_centre(whole) if options.centre is None else np.asarray(options.centre)

    def radius(points: Floats) -> Floats:
        flat = points - centre
        return np.linalg.norm(flat - (flat @ options.up)[:, None] * options.up, axis=1)

    corners = radius(patch.vertices)[patch.faces]
    outwards = gradients(patch, corners)
    steps = surface.steps(patch, outwards, options)
    levels = level_values(corners, np.linalg.norm(outwards, axis=1), steps)
    if len(levels) < 2:
        raise ToolpathError("the region is too small for a spiral of this stepover", key="stepover")

    def turn(facets: Ints, weights: Floats) -> Floats:
        """Turn k passes radius levels[k] half way round."""
        at = radius(_points(patch, facets, weights))
        inwards = 0.5 + (at - levels[0]) / (levels[1] - levels[0])
        outside = len(levels) - 0.5 + (at - levels[-1]) / (levels[-1] - levels[-2])
        between = np.interp(at, levels, np.arange(len(levels)) + 0.5)
        return np.where(at < levels[0], inwards, np.where(at > levels[-1], outside, between))

    itself = PatchOn.of(patch, lambda same: same)
    spiral, kept = _wound(itself, turn, 0.0, centre, options.up)
    shortest = options.shortest_pass(float(steps.max()))
    sources = lines_as_sources(spiral, steps, shortest=shortest).placed(itself.where(kept))
    passes = Passes.joined([spiral.lines(), gap_lines(patch, sources, steps)])
    return ContactPaths(passes, float(steps.max()), Order.ZIGZAG)


def _wound(on: PatchOn, turn: QuantityInside, first: float, centre: Floats, view: Floats) -> tuple[LevelSet, Bools]:
    """Return the spiral on a patch, and the facets (F,) used: all but those over the centre (3,), seen along the view.

    turn: of places on the patch on which it lies; turns pass where this is `first`, and one more each.
    """
    x, y = tangent_frame(view)

    def angle(points: Floats) -> Floats:
        """Polar angle about the centre, in turns, 0 to 1."""
        offset = points - centre
        return np.mod(np.arctan2(offset @ y, offset @ x) / (2.0 * np.pi), 1.0)

    whole = on.patch
    at_vertices = angle(whole.vertices)
    corners = at_vertices[whole.faces]
    # Whole turns to subtract at the corners of a facet so that the angle is continuous there.
    turns = np.rint(corners - corners[:, :1]).astype(np.intp)
    kept = np.ptp(corners - turns, axis=1) < 0.5
    used, turns, continuous = on.where(kept), turns[kept], (corners - turns)[kept]
    patch, turned = used.patch, used.carried(turn)

    def phase(facets: Ints, weights: Floats) -> Floats:
        exact = angle(_points(patch, facets, weights))
        near = (weights * continuous[facets]).sum(axis=1)
        return turned(facets, weights) - first - (exact + np.rint(near - exact))

    values = on.at_vertices(turn) - first - at_vertices
    return LevelSet(patch, values, np.zeros(0), turns, phase), kept


def _points(patch: Patch, facets: Ints, weights: Floats) -> Floats:
    """Return the places (N, 3) of facets (N,) at barycentric weights (N, 3)."""
    return (weights[:, :, None] * patch.vertices[patch.faces[facets]]).sum(axis=1)


STRATEGY = Strategy("spiral", SpiralOptions, spiral_paths)
