"""Is a wide part out of the machine's reach with its tool axes? An estimate tells so before a drive surface is made."""

from __future__ import annotations

import numpy as np

from pentapod.base.errors import InputError
from pentapod.base.units import from_si
from pentapod.geometry.directions import normalised
from pentapod.job.advice.options import OPTIONS, AdviceOptions
from pentapod.job.advice.settings import Settings
from pentapod.job.advice.sketch import Sketch
from pentapod.job.build.reach import DOUBTFUL, check_reach
from pentapod.job.build.region import covers_region, job_region
from pentapod.job.build.tool import job_tool
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch

LEAST_DEG = 0.01
"""Degrees by which the angle of a region is larger than the slope of its steepest facet: that lies on the border."""


def check_wide_part(job: Job, machine: Machine, mesh: Mesh, options: AdviceOptions = OPTIONS) -> None:
    """Raise JobError for a wide part to be machined whole, of which most is far out of reach with the job's tool axes.

    Its drive surface would take minutes, and then no placement would be found. What is steep counts for nothing, as
    far as a run might leave it out. Parts of a few widths of the work volume pass unseen: their toolpath takes seconds.
    """
    if not covers_region(job) or job.placement.setups > 1 or _width(mesh) <= DOUBTFUL * machine.work.diameter:
        return
    flattest = _flattest(job, mesh, options.flattest)
    if flattest is None or flattest[0] <= DOUBTFUL * machine.work.diameter:
        return
    width, flat = flattest
    sketch = Sketch.of_region(flat, mesh, job_tool(job, machine), options.points)
    if sketch is None:
        return
    found = Settings(flat, machine, mesh, sketch, None, options, lambda _: None).without_obstacles()
    if found.margin >= options.hopeless:
        return
    size, volume = (f"{from_si(value, 'mm'):,.0f} mm" for value in (width, machine.work.diameter))
    short = ", ".join(f"{each.constraint} by {each.shortfall:.3g} {each.unit}" for each in found.shortfalls[:2])
    raise job.error(
        "part", "scale",
        f"what is to be machined is {size} wide, the work volume {volume}, and no place was found for most of it with "
        f"these tool axes: {short}",
        expected="a part, or a region, that the machine reaches with the tool axes of [axis]",
        remedy="less of it with region_box_mm, other tool axes, or a smaller scale",
    )  # fmt: skip


def is_too_large(job: Job, machine: Machine, mesh: Mesh) -> bool:
    """Return whether a region is beyond the machine's reach: no toolpath of all of it is needed."""
    try:
        check_reach(job, machine, mesh)
        check_wide_part(job, machine, mesh)
    except InputError:
        return True
    return False


def _width(mesh: Mesh) -> float:
    return float(np.ptp(mesh.bounds, axis=0).max())


def _flattest(job: Job, mesh: Mesh, share: float) -> tuple[float, Job] | None:
    """Return the largest extent of the flattest part of a job's region, with a share of its area, and a job for it.

    None for an empty region.
    """
    patch, view = Patch.of(mesh, job_region(job)), normalised(job.part.si.region_direction)
    if not len(patch.faces):
        return None
    cosines, areas = patch.facet_normals @ view, patch.areas
    order = np.argsort(-cosines, kind="stable")
    area = np.cumsum(areas[order])
    last = order[min(int(np.searchsorted(area, share * area[-1])), len(order) - 1)]
    kept = cosines >= cosines[last]
    extents = np.ptp(patch.vertices[np.unique(patch.faces[kept])], axis=0)
    angle = float(from_si(np.arccos(np.clip(cosines[last], -1.0, 1.0)), "deg"))
    degrees = min(angle + LEAST_DEG, float(from_si(job_region(job).within, "deg")))
    return float(extents.max()), job.with_(part={"region_angle_deg": degrees})
