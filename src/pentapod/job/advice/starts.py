"""What to begin with where a region holds nothing, no toolpath can be made, or the part is of a doubtful size."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pentapod.base.errors import InputError
from pentapod.geometry.directions import normalised
from pentapod.job.advice.axes import OF_MODES, Changes, taken_out
from pentapod.job.advice.options import AdviceOptions
from pentapod.job.advice.wide_parts import is_too_large
from pentapod.job.build.region import covers_region, job_region
from pentapod.job.build.toolpath import job_toolpath, removes_gouges
from pentapod.job.build.values import job_mesh
from pentapod.job.schema.job import Job
from pentapod.job.schema.strategies import FILE, strategy_table
from pentapod.machine.machine import Machine
from pentapod.mesh.io.load import UNITS
from pentapod.mesh.io.registry import states_unit
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.patch import Patch
from pentapod.mesh.region_share import RegionShare
from pentapod.toolpath.gouge.report import GougeReport
from pentapod.toolpath.toolpath import Toolpath

_SIDES = tuple(tuple(sign if k == axis else 0.0 for k in range(3)) for axis in (2, 0, 1) for sign in (1.0, -1.0))


@dataclass(frozen=True, eq=False)
class Start:
    """A job to begin with. words, changes: empty for the job as it is. kept: as in `Advice`.

    toolpath: of this job, where it was made.
    """

    words: str
    changes: Changes
    job: Job
    mesh: Mesh
    kept: float = 1.0
    toolpath: Toolpath | None = None


def starts(
    job: Job, machine: Machine, mesh: Mesh, options: AdviceOptions, *, has_toolpath: bool = True
) -> Iterator[Start]:
    """Yield the jobs to begin with, the most promising first; those without a toolpath are left out.

    has_toolpath: whether the toolpath of the job is known to exist.
    """
    own = Start("", {}, job, mesh)
    if mesh.diagnosis.inverted and (
        repaired := _start(job, "the closed surface turned right side out", {"repair": True})
    ):
        yield repaired  # any other change would cut into the part from outside its walls
        return
    if not covers_region(job):
        yield _lifted(own, machine) or own
        return
    region = RegionShare.of(mesh, job_region(job)).inside > 0.0
    key = "region"
    if region:
        yield from _of_other_size(job, machine, mesh, options)
        if (near := _passes_beside(job, mesh, options)) and isinstance(made := _with_toolpath(near, machine), Start):
            yield made
        if has_toolpath or is_too_large(job, machine, mesh):
            yield own
            return
        made = _with_toolpath(own, machine)
        if isinstance(made, Start):
            yield made
            return
        key = made.key
    # Where there is nothing to machine, other passes over it come last.
    regions, others = _with_a_region(job, mesh), _with_other_paths(job, machine, mesh, options) if region else ()
    for start in (*regions, *others) if key == "region" else (*others, *regions):
        made = _with_toolpath(start, machine)
        if isinstance(made, Start):
            yield made


def _passes_beside(job: Job, mesh: Mesh, options: AdviceOptions) -> Start | None:
    """Return a job whose passes are further apart than its cutter is wide with passes beside each other; else None.

    None as well where all of the region may be left.
    """
    wide, apart = getattr(job.tool, "diameter_mm", None), getattr(job.toolpath, "stepover_mm", None)
    if wide is None or apart is None or apart <= wide or job.tolerance.left_share == 1.0:
        return None
    share = options.beside
    changes: Changes = {"toolpath": {"stepover_mm": round(share * wide, 3)}}
    return Start(f"passes {share:g} of the cutter's diameter apart", changes, job.with_(**changes), mesh)


def _with_toolpath(start: Start, machine: Machine) -> Start | InputError:
    """Return a start with its toolpath, or the error that there is none."""
    try:
        return replace(start, toolpath=job_toolpath(start.job, start.mesh, machine=machine)[0])
    except InputError as error:
        return error


def _lifted(own: Start, machine: Machine) -> Start | None:
    """Return a job whose toolpath was read and gouges, as every plan of it would, with its cuts lifted off the part."""
    if own.job.toolpath.strategy != FILE or removes_gouges(own.job):
        return None
    changes: Changes = {"gouge": {"remedy": ["lift"]}}
    with suppress(InputError):
        if not any(report.gouging for report in _gouges(own.job, own.mesh, machine)[1]):
            return None
        job = own.job.with_(**changes)
        toolpath, reports = _gouges(job, own.mesh, machine)
        if all(report.left == 0 for report in reports):
            return Start("cuts that gouge lifted off the part", changes, job, own.mesh, toolpath=toolpath)
    return None


def _gouges(job: Job, mesh: Mesh, machine: Machine) -> tuple[Toolpath, list[GougeReport]]:
    toolpath, reports = job_toolpath(job, mesh, machine=machine)
    return toolpath, [report for report in reports.parts if isinstance(report, GougeReport)]


def _with_other_paths(job: Job, machine: Machine, mesh: Mesh, options: AdviceOptions) -> Iterator[Start]:
    """Yield the job with other passes over its region, with other axes, and with a smaller cutter."""
    changes: list[tuple[str, Changes]] = [
        (f'the strategy "{name}"', {"toolpath": _strategy(job, name)})
        for name in options.strategies
        if name != job.toolpath.strategy
    ]
    view = [float(v) for v in normalised(job.part.si.region_direction)]
    axis = taken_out(job, "axis", (*OF_MODES, "tilt_deg"))
    changes.append(
        ("one direction of the tool for the whole path", {"axis": {**axis, "mode": "fixed", "direction": view}})
    )
    if getattr(job.tool, "diameter_mm", None) is not None:
        diameter = float(f"{options.thinner * job.tool.diameter_mm:.3g}")
        changes.append(("a smaller cutter", {"tool": {"diameter_mm": diameter}}))
    for words, tables in changes:
        with suppress(InputError):
            yield Start(words, tables, job.with_(**tables), mesh)


def _strategy(job: Job, name: str) -> dict[str, Any]:
    """Return the changes of [toolpath] for another strategy: keys that it does not have are taken out."""
    known = strategy_table(name).model_fields
    others = {key: None for key in job.toolpath.model_fields_set if key not in known}
    return {"strategy": name, **others}


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
    """Return the job with a region that holds something, the one that shows most of its surface first."""
    tries: list[tuple[str, dict[str, Any]]] = []
    box, angle = (taken_out(job, "part", (key,)) for key in ("region_box_mm", "region_angle_deg"))
    tries += [("no box", box)] if box else []
    tries += [("steeper places, too", angle)] if angle else []
    tries += [("a region without bounds", {**box, **angle})] if box and angle else []
    tries += [("the surface turned over", {"flip": not job.part.flip})] if not mesh.diagnosis.watertight else []
    tries += [("facets wound alike", {"repair": True})] if not job.part.repair else []
    tries += [("another side of the part", {"region_direction": list(side)}) for side in _SIDES]
    found = [start for start in (_start(job, *each) for each in tries) if start is not None and start.kept > 0.0]
    most = max((_shown(start) for start in found), default=0.0)
    # Sorting is stable: of changes that show as much, the first one is tried first.
    return sorted(found, key=lambda start: -round(_shown(start) / max(most, 1e-300), 2))


def _shown(start: Start) -> float:
    """Return the area of a start's region as its direction sees it, square metres."""
    patch, view = Patch.of(start.mesh, job_region(start.job)), normalised(start.job.part.si.region_direction)
    return float((patch.areas * np.maximum(patch.facet_normals @ view, 0.0)).sum())


def _start(job: Job, words: str, keys: dict[str, Any]) -> Start | None:
    """Return a job with other values of [part]; None where it cannot be used."""
    try:
        other = job.with_(part=keys)
        mesh = job_mesh(other)
    except InputError:
        return None
    share = RegionShare.of(mesh, job_region(other))
    return Start(words, {"part": keys}, other, mesh, min(share.inside / max(share.facing, 1e-300), 1.0))
