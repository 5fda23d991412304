"""RegionShare: how much of a surface a region holds, and why it does not hold the rest."""

from __future__ import annotations

from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np

from pentapod.base.values import Value
from pentapod.geometry.directions import tangent_frame
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.region import WALL_SLACK, Region


@dataclass(frozen=True)
class RegionShare(Value):
    """Shares of a surface's area, 0 to 1.

    facing: what does not show its back to the region's direction, upright walls included. boxed: what of that is in the
    box. inside: what the region holds. flattest: least angle in radians between the direction and the normals in the
    box; π where the box holds nothing. widths: extents across the direction of what the region holds, metres.
    """

    facing: float
    boxed: float
    inside: float
    flattest: float
    widths: tuple[float, float]

    @classmethod
    def of(cls, mesh: Mesh, region: Region) -> RegionShare:
        """Return the shares of a region of a mesh, reckoned once for each."""
        key = np.concatenate([region.direction, region.bounds.ravel(), [region.within]]).tobytes()
        known = _KNOWN.setdefault(mesh, {})
        if key not in known:
            known[key] = cls._of(mesh, region)
        return known[key]

    @classmethod
    def _of(cls, mesh: Mesh, region: Region) -> RegionShare:
        area = float(mesh.facet_areas.sum())
        cosine = mesh.facet_normals @ region.direction
        facing = float(mesh.facet_areas[cosine >= np.cos(0.5 * np.pi + WALL_SLACK)].sum())
        box = Patch.whole(mesh).in_box(region)
        inside = box.where_normals(region.faces)
        boxed, flattest = facing, float(np.arccos(np.clip(cosine.max(), -1.0, 1.0)))
        if region.box is not None:
            upright = box.where_normals(replace(region, angle=0.5 * np.pi).faces)
            boxed = float(upright.areas.sum())
            at = box.normals.reshape(-1, 3) @ region.direction
            flattest = float(np.arccos(np.clip(at.max(initial=-1.0), -1.0, 1.0)))
        held = np.zeros(len(inside.vertices), dtype=np.bool_)
        held[inside.faces.ravel()] = True
        points = inside.vertices[held] @ np.stack(tangent_frame(region.direction)).T
        x, y = np.ptp(points, axis=0) if len(points) else np.zeros(2)
        shares = (facing / area, boxed / area, float(inside.areas.sum()) / area)
        return cls(*shares, flattest=flattest, widths=(float(x), float(y)))


def why_empty(mesh: Mesh, region: Region) -> str:
    """Return why nothing in a region of a mesh can be machined."""
    found = RegionShare.of(mesh, region)
    degrees = float(np.degrees(found.flattest))
    if mesh.diagnosis.inverted:
        return "the closed surface is inside out"
    if found.inside > 0.0:
        return "all of it is hidden from the direction by the part above"
    if found.flattest <= 0.5 * np.pi + WALL_SLACK:
        within = float(np.degrees(region.within))
        return f"its flattest place is {degrees:.3g}° from the direction, and region_angle_deg is {within:.3g}"
    if region.box is not None and not len(Patch.whole(mesh).in_box(region).faces):
        extent = " x ".join(f"{a:.4g}..{b:.4g}" for a, b in zip(*(1e3 * mesh.bounds), strict=True))
        return f"the box holds nothing of the part, which spans {extent} mm"
    share = f"{100.0 * (1.0 - found.facing):.0f} % of the surface" if region.box is None else "the surface in the box"
    return f"{share} faces away from the direction"


_KNOWN: WeakKeyDictionary[Mesh, dict[bytes, RegionShare]] = WeakKeyDictionary()
