"""The cutter of a proposal, and what of a solid is left out so that it does not reach into the table."""

from __future__ import annotations

from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.units import from_si, to_si
from pentapod.geometry.directions import tangent_frame
from pentapod.job.proposal.options import OPTIONS
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch


def tool_for(patch: Patch, direction: Floats) -> dict[str, Any]:
    """Return the cutter for a region: a ball of a share of its size."""
    points = patch.vertices[np.unique(patch.faces)] @ np.stack(tangent_frame(direction)).T
    widest = float(from_si(np.ptp(points, axis=0).max(), "mm"))
    fitting = [size for size in OPTIONS.diameters if size <= OPTIONS.cutter * widest]
    return {"type": "ball", "diameter_mm": max(fitting, default=OPTIONS.diameters[0])}


def foot_key(mesh: Mesh, patch: Patch, direction: Floats, tool: dict[str, Any]) -> tuple[str, Any, str, str] | None:
    """Return the key of [part] that keeps the ball above the foot of a solid, its value, why, and a remark; or None."""
    radius = 0.5 * float(to_si(tool["diameter_mm"], "mm"))
    steep = patch.facet_normals @ direction < np.cos(to_si(OPTIONS.steep_deg, "deg"))
    if not mesh.diagnosis.watertight or _heights(mesh, patch, direction)[steep].min(initial=np.inf) >= radius:
        return None
    if (above := _above_the_foot(mesh, patch, direction, radius)) is not None:
        value = [[rounded(v) for v in corner] for corner in from_si(above, "mm")]
        why = "lower down the ball would reach below the part; leave it out on a riser"
        low = rounded(0.5 * tool["diameter_mm"])
        remark = f"the lowest {low:g} mm are left: the ball would reach into the table (region_box_mm)"
        return "region_box_mm", value, why, remark
    if (angle := _flatter(mesh, patch, direction, radius)) is not None:
        why = "at steeper places the ball would reach below this thin part"
        remark = f"only where it is flatter than {angle:g} deg: at steeper places the ball would reach into the table"
        return "region_angle_deg", angle, why, f"{remark} (region_angle_deg)"
    return None


def _heights(mesh: Mesh, patch: Patch, direction: Floats) -> Floats:
    """Return how high (F,) the lowest corner of each facet of a region is above the foot of the part, metres."""
    heights: Floats = (patch.vertices @ direction)[patch.faces].min(axis=1)
    return heights - float((mesh.vertices @ direction).min())


def _above_the_foot(mesh: Mesh, patch: Patch, direction: Floats, radius: float) -> Floats | None:
    """Return the box (2, 3) of a solid without its lowest ball radius; None where it would leave out most of it."""
    seen = patch.areas * np.maximum(patch.facet_normals @ direction, 0.0)
    if seen[_heights(mesh, patch, direction) >= radius].sum() < OPTIONS.above_foot * seen.sum():
        return None
    frame = np.stack([*tangent_frame(direction), direction])
    points, margin = mesh.vertices @ frame.T, radius
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    low[2] += margin + radius
    return np.sort(np.array([low, high]) @ frame, axis=0)


def _flatter(mesh: Mesh, patch: Patch, direction: Floats, radius: float) -> float | None:
    """Return the largest angle of the region, degrees, at which the ball stays above the foot of a part; or None."""
    heights = _heights(mesh, patch, direction)
    upright = patch.facet_normals @ direction
    for angle in OPTIONS.flatter_deg:
        least = np.cos(to_si(angle, "deg"))
        inside = upright >= least
        # The ball's lowest point is below its contact by r (1 - cos).
        if inside.any() and heights[inside].min() >= radius * (1.0 - least):
            return angle
    return None


def rounded(value: float) -> float:
    """Return a length in mm with at most two digits after the point."""
    return round(float(value), 2) + 0.0
