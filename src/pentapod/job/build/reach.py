"""Is the region of a job too large for its machine, whatever is planned? It may have the wrong unit."""

from __future__ import annotations

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.units import from_si
from pentapod.cutters.tool import Tool
from pentapod.geometry.runs import distinct
from pentapod.job.build.region import covers_region, job_region
from pentapod.job.build.tool import job_tool
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine
from pentapod.machine.reach import reach
from pentapod.mesh.io.load import UNITS
from pentapod.mesh.io.registry import states_unit
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch

DOUBTFUL = 2.5
"""Width of a part, in widths of the work volume, from which its unit is doubted where another one makes it fit."""


def check_reach(job: Job, machine: Machine, mesh: Mesh) -> None:
    """Raise JobError for a region that no plan can cover: in more places than there are set-ups, too far apart.

    In one set-up all tips are nearer to each other than `reach`. So the job cannot be done where the region has more
    points, each farther than that from the others, than set-ups; twice the distance of tips from their contacts and a
    stepover at each end are allowed for. Lines that cover no region may lie anywhere on the part, and pass. An empty
    region of a part whose unit is doubtful raises, too: the region's box may be in the right unit.

    That bound is wide. A part that is to be machined whole, in one set-up, is refused from DOUBTFUL times the width of
    the work volume on where another unit of its numbers makes it fit.
    """
    if not covers_region(job):
        return
    apart = farthest_apart(job, machine)
    if np.linalg.norm(np.ptp(mesh.bounds, axis=0)) <= apart:
        _check_unit(job, machine, mesh)
        return
    region = Patch.of(mesh, job_region(job))
    points = region.vertices[distinct(region.faces)]
    if len(points) and _far_apart(points, apart, job.placement.setups + 1) <= job.placement.setups:
        return
    extents = np.ptp(mesh.bounds, axis=0)
    size, width = (f"{from_si(value, 'mm'):,.0f} mm" for value in (extents.max(), machine.work.diameter))
    key, remedy = "scale", "scale = 0.001 if the numbers are millimetres, not metres"
    if not states_unit(job.mesh_path):
        known = UNITS[job.part.unit]
        wide = {name: extents.max() * metres / known / machine.work.diameter for name, metres in UNITS.items()}
        unit = min(wide, key=lambda name: (wide[name] > 1.0, abs(np.log(wide[name]))))  # those first that fit
        key = "scale" if unit == job.part.unit else "unit"
        remedy = None if unit == job.part.unit else f'unit = "{unit}"?'
    if not len(points) and key == "scale":
        return
    raise job.error(
        "part", key, f"the part is {size} wide, the work volume {width}",
        expected=f"places to machine within {from_si(apart, 'mm'):,.0f} mm, the most that any tool tip can move",
        remedy=remedy,
    )  # fmt: skip


def _check_unit(job: Job, machine: Machine, mesh: Mesh) -> None:
    """Raise JobError for a part that is machined whole, too wide by far, and fits with another unit of its numbers."""
    asked, extent, width = job.part, float(np.ptp(mesh.bounds, axis=0).max()), machine.work.diameter
    whole = asked.region_box_mm is None and job.placement.setups == 1
    if states_unit(job.mesh_path) or not whole or extent <= DOUBTFUL * width:
        return
    fits = [name for name, metres in UNITS.items() if extent * metres / UNITS[asked.unit] <= width]
    if fits:
        size, volume = (f"{from_si(value, 'mm'):,.0f} mm" for value in (extent, width))
        raise job.error(
            "part", "unit", f"the part is {size} wide, the work volume {volume}",
            expected=f"the unit of the numbers in {job.mesh_path.name}",
            remedy=f'unit = "{max(fits, key=UNITS.__getitem__)}"? If "{asked.unit}" is right, say with region_box_mm '
            "what is machined, or allow several placement.setups",
        )  # fmt: skip


def farthest_apart(job: Job, machine: Machine) -> float:
    """Return a distance of two places of a region, metres, beyond which no set-up reaches both."""
    stepover = getattr(job.toolpath.si, "stepover", None) or 0.0
    return reach(machine) + 2.0 * (2.0 * _tip_distance(job_tool(job)) + stepover)


def _far_apart(points: Floats, distance: float, most: int) -> int:
    """Return how many points (N, 3), up to `most`, are chosen one after the other, each far from all before."""
    if not len(points):
        return 0
    nearest, count = np.linalg.norm(points - points.mean(axis=0), axis=1), 0
    chosen = int(nearest.argmax())
    nearest = np.full(len(points), np.inf)
    while count < most and nearest[chosen] > distance:
        nearest = np.minimum(nearest, np.linalg.norm(points - points[chosen], axis=1))
        count, chosen = count + 1, int(nearest.argmax())
    return count


def _tip_distance(tool: Tool) -> float:
    """Return the largest distance of the tip from a contact, for axes up to a right angle from the normal, metres."""
    angle = np.linspace(0.0, 0.5 * np.pi, 19)
    normals = np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=1)
    axes = np.tile([0.0, 0.0, 1.0], (len(angle), 1))
    return float(np.linalg.norm(tool.tips(np.zeros_like(normals), normals, axes), axis=1).max())
