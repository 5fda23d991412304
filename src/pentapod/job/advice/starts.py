"""What to begin with where a region holds nothing, or the part is of a doubtful size: other values for [part]."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pentapod.base.errors import InputError
from pentapod.job.advice.axes import Changes, taken_out
from pentapod.job.advice.options import AdviceOptions
from pentapod.job.build.region import covers_region, job_region
from pentapod.job.build.values import job_mesh
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine
from pentapod.mesh.io.load import UNITS
from pentapod.mesh.io.registry import states_unit
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.region_share import RegionShare

_SIDES = tuple(tuple(sign if k == axis else 0.0 for k in range(3)) for axis in (2, 0, 1) for sign in (1.0, -1.0))


@dataclass(frozen=True, eq=False)
class Start:
    """A job to begin with. words, changes: empty for the job as it is. kept: as in `Advice`."""

    words: str
    changes: Changes
    job: Job
    mesh: Mesh
    kept: float = 1.0


def starts(job: Job, machine: Machine, mesh: Mesh, options: AdviceOptions) -> list[Start]:
    """Return the jobs to begin with, the most promising first; none where no region was found to hold anything."""
    own = Start("", {}, job, mesh)
    if not covers_region(job):
        return [own]
    if RegionShare.of(mesh, job_region(job)).inside > 0.0:
        return [*_of_other_size(job, machine, mesh, options), own]
    return _with_a_region(job, mesh)


def _of_other_size(job: Job, machine: Machine, mesh: Mesh, options: AdviceOptions) -> list[Start]:
    """Return the job with the unit that brings a part of doubtful size nearest to the work volume."""
    largest, width = float(np.ptp(mesh.bounds, axis=0).max()), machine.work.diameter
    if largest <= options.doubtful * width:
        return []
    if states_unit(job.mesh_path):
        keys: dict[str, Any] = {"scale": 0.001 * job.part.scale}
        words = "the numbers of the mesh in mm, not m"
    else:
        known = UNITS[job.part.unit]
        unit = min(UNITS, key=lambda name: abs(np.log(largest * UNITS[name] / known / width)))
        if unit == job.part.unit:
            return []
        keys, words = {"unit": unit}, f"the numbers of the mesh in {unit}, not {job.part.unit}"
    return [found for found in [_start(job, words, keys)] if found is not None]


def _with_a_region(job: Job, mesh: Mesh) -> list[Start]:
    """Return the job with a region that holds something, the one with most of the surface first."""
    tries: list[tuple[str, dict[str, Any]]] = []
    box, angle = (taken_out(job, "part", (key,)) for key in ("region_box_mm", "region_angle_deg"))
    tries += [("no box", box)] if box else []
    tries += [("steeper places, too", angle)] if angle else []
    tries += [("a region without bounds", {**box, **angle})] if box and angle else []
    tries += [("the surface turned over", {"flip": not job.part.flip})] if not mesh.diagnosis.watertight else []
    tries += [("facets wound alike", {"repair": True})] if not job.part.repair else []
    tries += [("another side of the part", {"region_direction": list(side)}) for side in _SIDES]
    found = [start for start in (_start(job, *each) for each in tries) if start is not None and start.kept > 0.0]
    # Sorting is stable: of changes that keep as much, the first one is tried first.
    return sorted(found, key=lambda start: -round(start.kept, 2))


def _start(job: Job, words: str, keys: dict[str, Any]) -> Start | None:
    """Return a job with other values of [part]; None where it cannot be used."""
    try:
        other = job.with_(part=keys)
        mesh = job_mesh(other)
    except InputError:
        return None
    share = RegionShare.of(mesh, job_region(other))
    return Start(words, {"part": keys}, other, mesh, share.inside / max(share.facing, 1e-300))
