"""The cutter of a proposal, and what of a solid is left out so that it does not reach into the table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.units import from_si, to_si
from pentapod.geometry.directions import tangent_frame
from pentapod.geometry.runs import distinct
from pentapod.job.proposal.options import OPTIONS
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch


@dataclass(frozen=True)
class Cutter:
    """A ball for a region. why: it is not the usual one, or empty. foot: what keeps it above the foot of the part."""

    diameter_mm: float
    why: str = ""
    foot: Foot | None = None


@dataclass(frozen=True)
class Foot:
    """A key of [part], its value, why, and a sentence to print. keeps: share of the area."""

    key: str
    value: Any
    why: str
    remark: str
    keeps: float


def cutter_for(mesh: Mesh, patch: Patch, direction: Floats, *, stands: bool) -> Cutter:
    """Return the cutter for a region: a ball of a share of its size, smaller ones where that reaches below most of it.

    stands: whether the whole part stands on the table, so that its foot counts.
    """
    usual = _usual(patch, direction)
    if not stands or not mesh.diagnosis.watertight:
        return Cutter(usual)
    feet = _Feet(mesh, patch, direction)
    sizes = [size for size in OPTIONS.diameters if OPTIONS.smaller * usual <= size <= usual]
    others: list[tuple[float, Cutter]] = []
    for size in reversed(sizes):
        why = "" if size == usual else "a larger ball would reach below most of this part"
        radius = 0.5 * float(to_si(size, "mm"))
        if feet.clear(radius):
            return Cutter(size, why)
        for foot in (feet.above(radius), feet.flatter(radius)):
            if foot is not None and foot.keeps >= OPTIONS.above_foot:
                return Cutter(size, why, foot)
            if foot is not None:
                others.append((foot.keeps, Cutter(size, why, foot)))
    keeps, best = max(others, key=lambda other: other[0])
    return best if keeps > 0.0 else Cutter(usual)


def _usual(patch: Patch, direction: Floats) -> float:
    """Return the usual diameter of a ball for a region, mm."""
    points = patch.vertices[distinct(patch.faces)] @ np.stack([*tangent_frame(direction), direction]).T
    across, along, high = from_si(np.ptp(points, axis=0), "mm")
    least, most = min(across, along), max(across, along, high)
    largest = min(OPTIONS.cutter * most, OPTIONS.narrow * least)
    return max((size for size in OPTIONS.diameters if size <= largest), default=OPTIONS.diameters[0])


class _Feet:
    """How high the facets of a region are above the foot of a solid, metres; areas, and those seen, as shares."""

    def __init__(self, mesh: Mesh, patch: Patch, direction: Floats) -> None:
        self.mesh, self.direction = mesh, direction
        self.upright = patch.facet_normals @ direction
        self.heights = (patch.vertices @ direction)[patch.faces].min(axis=1) - float((mesh.vertices @ direction).min())
        self.areas = patch.areas / patch.areas.sum()
        seen = self.areas * np.maximum(self.upright, 0.0)
        self.seen = seen / seen.sum()

    def clear(self, radius: float) -> bool:
        """Return whether a ball stays above the foot at all steep places."""
        steep = self.upright < np.cos(to_si(OPTIONS.steep_deg, "deg"))
        return bool(self.heights[steep].min(initial=np.inf) >= radius)

    def above(self, radius: float) -> Foot:
        """Return the box of the part without its lowest ball radius."""
        frame = np.stack([*tangent_frame(self.direction), self.direction])
        points = self.mesh.vertices @ frame.T
        low, high = points.min(axis=0) - radius, points.max(axis=0) + radius
        low[2] += 2.0 * radius
        box = np.sort(np.array([low, high]) @ frame, axis=0)
        value = [[rounded(v) for v in corner] for corner in from_si(box, "mm")]
        why = "lower down the ball would reach below the part; leave it out on a riser"
        left = rounded(float(from_si(radius, "mm")))
        remark = f"the lowest {left:g} mm are left: the ball would reach into the table (region_box_mm)"
        return Foot("region_box_mm", value, why, remark, float(self.seen[self.heights >= radius].sum()))

    def flatter(self, radius: float) -> Foot | None:
        """Return the largest angle of the region at which a ball stays above the foot; None if there is none."""
        for angle in OPTIONS.flatter_deg:
            least = np.cos(to_si(angle, "deg"))
            inside = self.upright >= least
            # The ball's lowest point is below its contact by r (1 - cos).
            if inside.any() and self.heights[inside].min() >= radius * (1.0 - least):
                why = "at steeper places the ball would reach below this thin part"
                remark = (
                    f"only where it is flatter than {angle:g} deg: at steeper places the ball would reach into the "
                    "table (region_angle_deg)"
                )
                return Foot("region_angle_deg", angle, why, remark, float(self.areas[inside].sum()))
        return None


def rounded(value: float) -> float:
    """Return a length in mm with at most two digits after the point."""
    return round(float(value), 2) + 0.0
