"""Stepover for a given scallop height.

Across the passes, a surface of normal curvature κ is a circle of radius 1 / κ (positive: convex), and a ball of radius
r follows one of radius 1 / κ + r. Two balls whose contacts are s apart along the surface leave a ridge h where the
circles meet. By the law of cosines, with α half the angle between the contacts seen from the centre,

    4 sin²(α / 2) = κ² h (2 r − h) / ((1 + κ h) (1 + κ r)),    s = 2 α / κ,

and s = 2 √(h (2 r − h)) on a plane. On a dome ridges are higher than on a plane, in a hollow lower.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from pentapod.base.arrays import Floats, as_floats
from pentapod.base.errors import ToolpathError
from pentapod.cutters.tool import Tool
from pentapod.mesh.patch import Patch
from pentapod.mesh.query.levels import gradients

_TIGHTEST = -0.9


def stepover_for(scallop: float, radius: float, curvature: ArrayLike = 0.0) -> Floats:
    """Return the distance (...) along the surface, metres, between passes of a ball that leave such a ridge.

    scallop, radius: metres, scallop below radius. curvature (...): 1/m across the passes, positive where the
    surface is convex; hollows narrower than the ball, where no scallop is left, count as just wide enough.
    """
    k = np.maximum(as_floats(curvature, "curvature"), _TIGHTEST / radius)
    flat = np.sqrt(scallop * (2.0 * radius - scallop))
    chord = flat / np.sqrt((1.0 + k * scallop) * (1.0 + k * radius))
    x = np.clip(0.5 * np.abs(k) * chord, 0.0, 1.0)
    return 2.0 * chord * np.where(x > 1e-6, np.arcsin(x) / np.where(x > 1e-6, x, 1.0), 1.0)


def ridge(stepover: float, tool: Tool) -> float:
    """Return the height of the ridge, metres, that a cutter leaves between passes on a plane.

    Of a rounded corner that is narrower than the passes are apart, and of a flat end: as of a ball as wide as the tool.
    A tool wider than which the passes are apart leaves all that its radius holds.
    """
    radius = tool.scallop_radius or 0.0
    if 0.5 * stepover > radius:
        radius = max((s.low_radius + s.rounding for s in tool.solids if s.kind == "cutter"), default=radius)
    half = min(0.5 * stepover, radius)
    return radius - float(np.sqrt(radius**2 - half**2))


def cutting_radius(tool: Tool, scallop: float) -> float:
    """Return the radius that leaves the scallop. Raises ToolpathError for a tool without, or a scallop too high."""
    radius = tool.scallop_radius
    if radius is None:
        raise ToolpathError("this tool leaves no scallop", key="scallop", value=scallop, remedy="give the stepover")
    if scallop >= radius:
        raise ToolpathError(
            "the scallop must be lower than the ball's radius", key="scallop", value=scallop, expected=f"< {radius}"
        )
    return float(radius)


def curvatures(patch: Patch, directions: Floats) -> Floats:
    """Return the normal curvature (F,) in 1/m along directions (F, 3), of the smooth normals; positive is convex.

    Directions are projected on the facets; zero where nothing is left of them.
    """
    normals = patch.normals / np.maximum(np.linalg.norm(patch.normals, axis=2, keepdims=True), 1e-300)
    flat = directions - (directions * patch.facet_normals).sum(axis=1, keepdims=True) * patch.facet_normals
    length = np.linalg.norm(flat, axis=1, keepdims=True)
    flat = np.where(length > 1e-12, flat / np.where(length > 1e-12, length, 1.0), 0.0)
    # Along the direction the normal changes by the sum of its components' slopes.
    change = np.stack([(gradients(patch, normals[..., k]) * flat).sum(axis=1) for k in range(3)], axis=1)
    return (change * flat).sum(axis=1)


def surface_steps(
    patch: Patch, tool: Tool, directions: Floats, stepover: float | None, scallop: float | None
) -> Floats:
    """Return how far apart (F,) passes may be on each facet, across `directions`' passes: (F, 3) points across."""
    if stepover is not None:
        return np.full(len(patch.faces), stepover)
    height = 0.0 if scallop is None else scallop
    return stepover_for(height, cutting_radius(tool, height), curvatures(patch, directions))
