"""Stepover for a given scallop height, and levels at which passes keep a stepover.

Across the passes, a surface of normal curvature κ is a circle of radius 1 / κ (positive: convex), and a ball of radius
r follows one of radius 1 / κ + r. Two balls whose contacts are s apart along the surface leave a scallop of height h
where the circles meet. By the law of cosines, with α half the angle between the contacts seen from the centre,

    4 sin²(α / 2) = κ² h (2 r − h) / ((1 + κ h) (1 + κ r)),    s = 2 α / κ,

and s = 2 √(h (2 r − h)) on a plane. Scallops are higher on convex surfaces than on a plane, lower on concave ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats
from pentapod.base.errors import ToolpathError
from pentapod.cutters.tool import Tool
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.levels import gradients, spread
from pentapod.toolpath.options import CoverOptions


@dataclass(frozen=True)
class StepoverOptions:
    """Bounds of the computation.

    most_concave: smallest curvature times ball radius; at −1 the ball fills the concave surface. widest: largest
    stepover of centres around an edge, as a multiple of that over a plane. least_slope: smallest change of a level
    quantity per metre of surface, which bounds the density of levels.
    """

    most_concave: float = -0.9
    least_slope: float = 0.05
    widest: float = 2.0


def stepover_for(
    scallop: float, radius: float, curvature: ArrayLike = 0.0, options: StepoverOptions = StepoverOptions()
) -> Floats:
    """Return the distance (...) along the surface, metres, between passes of a ball that leave a scallop.

    scallop, radius: metres, scallop below radius. curvature (...): 1/m across the passes, positive where the
    surface is convex; a concave radius smaller than the ball's counts as slightly larger than it.
    """
    k = np.maximum(as_floats(curvature, "curvature"), options.most_concave / radius)
    flat = np.sqrt(scallop * (2.0 * radius - scallop))
    chord = flat / np.sqrt((1.0 + k * scallop) * (1.0 + k * radius))
    x = np.clip(0.5 * np.abs(k) * chord, 0.0, 1.0)
    return 2.0 * chord * np.where(x > 1e-6, np.arcsin(x) / np.where(x > 1e-6, x, 1.0), 1.0)


def offset_stepover_for(
    scallop: float, radius: float, curvature: ArrayLike = 0.0, options: StepoverOptions = StepoverOptions()
) -> Floats:
    """Return the distance (...) along the offset surface, metres, between centres of a ball that leave a scallop.

    curvature (...): of the offset surface across the passes, κ / (1 + κ r) for κ of the part; see `stepover_for`.
    """
    least = options.most_concave / (1.0 + options.most_concave)
    most = (1.0 - options.widest**-2) / (radius - scallop)
    k = np.clip(as_floats(curvature, "curvature"), least / radius, min(most, 1.0 / radius))
    chord = np.sqrt(scallop * (2.0 * radius - scallop) / (1.0 - k * (radius - scallop)))
    x = np.clip(0.5 * np.abs(k) * chord, 0.0, 1.0)
    return 2.0 * chord * np.where(x > 1e-6, np.arcsin(x) / np.where(x > 1e-6, x, 1.0), 1.0)


def scallop_height(stepover: float, tool: Tool) -> float:
    """Return the scallop height, metres, that a cutter leaves between passes on a plane.

    For a flat end, or a corner radius below half the stepover, it is that of a ball as wide as the tool. If the passes
    are further apart than the tool is wide, it is the radius.
    """
    radius = tool.scallop_radius or 0.0
    if 0.5 * stepover > radius:
        radius = max((s.low_radius + s.rounding for s in tool.solids if s.kind == "cutter"), default=radius)
    half = min(0.5 * stepover, radius)
    return radius - float(np.sqrt(radius**2 - half**2))


def curvatures(patch: Patch, directions: Floats) -> Floats:
    """Return the normal curvature (F,) of the smooth normals along directions (F, 3) or (3,), 1/m; positive is convex.

    Directions are projected on the facets; where a projection vanishes, the curvature is zero.
    """
    normals = patch.normals / np.maximum(np.linalg.norm(patch.normals, axis=2, keepdims=True), 1e-300)
    flat = directions - (directions * patch.facet_normals).sum(axis=1, keepdims=True) * patch.facet_normals
    length = np.linalg.norm(flat, axis=1, keepdims=True)
    flat = np.where(length > 1e-12, flat / np.where(length > 1e-12, length, 1.0), 0.0)
    change = np.stack([(gradients(patch, normals[..., k]) * flat).sum(axis=1) for k in range(3)], axis=1)
    return (change * flat).sum(axis=1)


def surface_steps(
    patch: Patch, radius: float | None, across: Floats, options: CoverOptions, *, offset: bool = False
) -> Floats:
    """Return the stepover (F,) on each facet, metres. across (F, 3) or (3,): directions across the passes.

    radius: of the rounding that leaves scallops, metres; None if there is none. offset: the patch is of the offset
    surface of a ball of this radius, not of the part. Raises ToolpathError for a scallop that does not suit it.
    """
    if options.stepover is not None:
        return np.full(len(patch.faces), options.stepover)
    height = options.scallop or 0.0
    if radius is None:
        raise ToolpathError("this tool leaves no scallop", key="scallop", value=height, remedy="give the stepover")
    if height >= radius:
        raise ToolpathError(
            "the scallop must be lower than the ball's radius", key="scallop", value=height, expected=f"< {radius}"
        )
    return (offset_stepover_for if offset else stepover_for)(height, radius, curvatures(patch, across))


def level_values(corners: Floats, slope: Floats, steps: Floats, options: StepoverOptions = StepoverOptions()) -> Floats:
    """Return ascending levels (L,) of a quantity whose level lines are nowhere further apart than the stepover.

    corners (F, 3): the quantity at the facets' corners. slope (F,): its change per metre of surface. steps (F,): the
    stepover, metres.
    """
    density = 1.0 / (steps * np.maximum(slope, options.least_slope))
    return spread(corners.min(axis=1), corners.max(axis=1), density)
