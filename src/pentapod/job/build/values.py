"""Machine, further limits and mesh from a job."""

from __future__ import annotations

import dataclasses
from contextlib import suppress
from typing import Any, cast
from weakref import WeakValueDictionary

import numpy as np

from pentapod.base.errors import InputError, MachineError, MeshError
from pentapod.base.keys import fields_from, oversized
from pentapod.base.progress import Progress, silent
from pentapod.base.units import from_si
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine
from pentapod.machine.parts import ControllerSettings, ToolLimits
from pentapod.mesh.io.load import load_mesh
from pentapod.mesh.mesh import Mesh
from pentapod.toolpath.axis.orientation import Orientation
from pentapod.toolpath.gouge.report import GougeOptions
from pentapod.toolpath.strategies.registry import STRATEGIES

LARGEST_TOLERANCE = 0.1
"""Largest tolerance that makes sense, as a share of the part's largest extent."""


SLACK = 1e-6
"""Metres by which the stock may be smaller than the part, for rounding."""

_READ: WeakValueDictionary[tuple[object, ...], Mesh] = WeakValueDictionary()
"""Meshes in use, by file and keys: with the same mesh, other jobs for a part share what was made from it."""


def job_machine(job: Job, machine: Machine | None = None) -> Machine:
    """Return the machine with the job's tool length, controller settings, tool limits and cutting force.

    machine: the one to use instead of the machine that the job names. Raises MachineError where its file is wrong,
    InputError where `machine` is none, JobError where the tool length or the cutting force does not go with it.
    """
    if machine is None:
        machine = Machine.load(job.machine_file or str(job.machine.name))
    elif not isinstance(cast(Any, machine), Machine):
        raise InputError(
            "not a machine", key="machine", value=machine, expected="a Machine", remedy="Machine.load(name or file)"
        )
    controller = ControllerSettings(
        period=machine.controller.period if job.output.period_ms is None else job.output.si.period,
        interpolation=job.output.interpolation or machine.controller.interpolation,
    )
    length = machine.tool_length if job.tool.length_mm is None else job.tool.si.length
    limits = machine.tool_limits.and_(ToolLimits(**fields_from(ToolLimits, job.feed)))
    cutting = job.feed.si.cutting_force
    if cutting > 0.0 and not (machine.drive_forces.limited or machine.stiffness.given):
        remedy = "give peak_force_n in [drives] or stiffness_n_um in [legs] of the machine file, or leave the force out"
        what = "the machine says nothing of the force of its drives, nor of its stiffness"
        raise job.error("feed", "cutting_force_n", what, value=cutting, remedy=remedy)
    weight = job.placement.weight_stiffness
    if weight is not None and not machine.yielding_known:
        remedy = "give stiffness_n_um in [legs] of a machine without arms and passive limb, or leave it out"
        what = "how stiff this machine is at the tip is not known"
        raise job.error("placement", "weight_stiffness", what, value=weight, remedy=remedy)
    deflection = job.tolerance.deflection_mm
    if deflection is not None and not machine.yielding_known:
        remedy = "give stiffness_n_um in [legs] of a machine without arms and passive limb, or leave it out"
        what = "how far the tip deflects is not known on this machine"
        raise job.error("tolerance", "deflection_mm", what, value=deflection, remedy=remedy)
    asked = job.output.compensation
    if asked == "process" and not cutting > 0.0:
        what, remedy = (
            "there is no process force to compensate for",
            "give feed.cutting_force_n, or ask for gravity alone",
        )
        raise job.error("output", "compensation", what, remedy=remedy)
    if asked not in (None, "none") and not machine.yielding_known:
        remedy = "give stiffness_n_um in [legs] of a machine without arms and passive limb, or leave it out"
        what = "how far the legs of this machine yield is not known"
        raise job.error("output", "compensation", what, remedy=remedy)
    try:
        return dataclasses.replace(
            machine, controller=controller, tool_length=length, tool_limits=limits, cutting_force=cutting
        )
    except MachineError as error:
        raise job.error("tool", "length_mm", error.what) from error


def is_compensated(job: Job, machine: Machine) -> bool:
    """Return whether drives compensate for what legs yield to weight; machine: that of the job.

    A calibration has found shorter legs where the weight makes them shorter: there it must be asked for.
    """
    asked = job.output.compensation
    return machine.yielding_known and (machine.calibration is None if asked is None else asked != "none")


def job_mesh(job: Job, progress: Progress = silent) -> Mesh:
    """Return the job's mesh: the same value as long as it is in use, and its file and its keys are the same.

    Raises MeshError, or JobError where its unit, or lengths of the job, do not suit it.
    """
    part, path = job.part, job.mesh_path
    keys = {
        "scale": part.scale, "repair": part.repair, "flip": part.flip, "least_body": part.si.least_body,
        "chordal": job.tolerance.si.chordal,
    }  # fmt: skip
    mesh, known = None, None
    with suppress(OSError):  # reading the file tells why
        state = path.stat()
        when = (state.st_mtime_ns, state.st_ctime_ns, state.st_ino, state.st_size)
        known = (path.resolve(), *when, part.unit, *keys.values())
        mesh = _READ.get(known)
    if mesh is None:
        try:
            mesh = load_mesh(path, part.unit, **keys, progress=progress)
        except MeshError as error:
            if error.key not in ("unit", "least_body_mm"):
                raise
            raise job.error("part", error.key, error.what, expected=error.expected, remedy=error.remedy) from error
        if known is not None:
            _READ[known] = mesh
    _check_sizes(job, mesh)
    return mesh


def _check_sizes(job: Job, mesh: Mesh) -> None:
    """Raise JobError for a tolerance or another length that is too large for the part."""
    size = np.ptp(mesh.bounds, axis=0)
    if job.part.si.stock is not None and (np.asarray(job.part.si.stock) < size - SLACK).any():
        least = " x ".join(f"{from_si(extent, 'mm'):.4g}" for extent in size)
        raise job.error("part", "stock_mm", "the stock is smaller than the part", expected=f"at least {least} mm")
    extent = float(size.max())
    largest = f"the part, whose largest extent is {from_si(extent, 'mm'):.4g} mm"
    remedy = "check part.unit and part.scale"
    for key, value in (("chordal_mm", job.tolerance.si.chordal), ("path_mm", job.tolerance.si.path)):
        if value > LARGEST_TOLERANCE * extent:
            expected = f"at most {from_si(LARGEST_TOLERANCE * extent, 'mm'):.3g}"
            what = f"the tolerance is too large for {largest}"
            raise job.error("tolerance", key, what, expected=expected, remedy=remedy)
    options: dict[str, type] = {"axis": Orientation, "gouge": GougeOptions}
    if job.toolpath.strategy in STRATEGIES:
        options["toolpath"] = STRATEGIES[job.toolpath.strategy].options
    for table, cls in options.items():
        values = fields_from(cls, getattr(job, table))
        if (item := oversized(cls, values, extent)) is not None:
            expected = f"at most {from_si(item.key.of_part * extent, 'mm'):.4g}"
            raise job.error(table, item.file_key, f"too large for {largest}", expected=expected, remedy=remedy)
