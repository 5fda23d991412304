"""The error of a region without surface to machine, with its cause as far as it can be found."""

from __future__ import annotations

from pentapod.base.errors import ToolpathError
from pentapod.mesh.mesh import Mesh
from pentapod.toolpath.options import PathOptions


def nothing_left(mesh: Mesh, options: PathOptions, dropped: int) -> ToolpathError:
    """Return the error that says why no pass is left, as far as it can be told."""
    away = float(mesh.facet_areas[mesh.facet_normals @ options.region.direction < 0.0].sum() / mesh.facet_areas.sum())
    if dropped:
        short = 1e3 * options.shortest
        remedy = f"all {dropped} passes are shorter than {short:.3g} mm; check the unit of the mesh"
    elif options.region.box is not None:
        low, high = 1e3 * mesh.bounds
        extent = " x ".join(f"{a:.4g}..{b:.4g}" for a, b in zip(low, high, strict=True))
        remedy = f"check the box against the part, which spans {extent} mm"
    else:
        remedy = (
            f"{100.0 * away:.0f} % of the surface faces away from the direction; "
            "turn the direction, or repair the winding"
        )
    return ToolpathError("the region holds nothing to machine", key="region", remedy=remedy)
