"""Region of a job: how much of the part it holds, with what a user would want to know before planning."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import fields_from
from pentapod.base.units import from_si
from pentapod.base.values import Value
from pentapod.cutters.bull_nose import BullNose
from pentapod.cutters.mounted import BallEnded
from pentapod.cutters.registry import CUTTERS
from pentapod.geometry.directions import normalised
from pentapod.job.schema.job import Job
from pentapod.machine.machine import Machine
from pentapod.mesh.io.registry import states_unit
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.region import ON_PART, Region
from pentapod.mesh.region_share import RegionShare, why_empty
from pentapod.toolpath.options import CoverOptions
from pentapod.toolpath.strategies.registry import STRATEGIES

WIDE = 1.5
"""Width of a part, as a multiple of the work volume's, beyond which its unit is asked about."""

LEAST_SHARE = 0.5
"""Share of the surface that the direction sees, below which the region is called small."""


@dataclass(frozen=True)
class RegionReport(Value):
    """How much of the surface a job machines. problems: sentences."""

    share: RegionShare
    problems: tuple[str, ...]

    def __str__(self) -> str:
        found = self.share
        text = f"region: {_percent(found.inside)} of the surface"
        if found.facing < 1.0:
            text += f", {_percent(min(found.inside / max(found.facing, 1e-300), 1.0))} of what faces its direction"
        return "\n".join([text, *(f"  problem: {problem}" for problem in self.problems)])


def job_region(job: Job) -> Region:
    """Return the part of the surface that a job machines; its angle is given."""
    region = Region(**fields_from(Region, job.part))
    return replace(region, angle=0.5 * np.pi if rolls(job) else ON_PART) if region.angle is None else region


def rolls(job: Job) -> bool:
    """Return whether the job's strategy draws on the surface on which its cutter rolls over the part."""
    strategy, cutter = job.toolpath.strategy, CUTTERS[job.tool.type]
    if strategy not in STRATEGIES or not STRATEGIES[strategy].options.rolls:
        return False
    return issubclass(cutter, BallEnded) or (issubclass(cutter, BullNose) and kept_axis(job) is not None)


def kept_axis(job: Job) -> Floats | None:
    """Return the axis (3,), unit, that the job's tool keeps everywhere; None where the axis may turn."""
    axis = job.axis.si
    if axis.mode != "fixed" or axis.tilt or axis.lead or axis.side:
        return None
    return np.asarray(normalised(axis.direction))


def covers_region(job: Job) -> bool:
    """Return whether the job's strategy covers a region by passes side by side."""
    strategy = job.toolpath.strategy
    return strategy in STRATEGIES and issubclass(STRATEGIES[strategy].options, CoverOptions)


def region_report(job: Job, mesh: Mesh, machine: Machine | None = None) -> RegionReport:
    """Return how much of the part's surface a job's region holds, and the problems that this suggests.

    machine: whose work volume the part is compared with, where its file states no unit; None for no comparison.
    Raises ToolpathError where the region holds nothing: a ball would roll over the back of a sheet, too.
    """
    region, problems = job_region(job), list[str]()
    widest = float(np.ptp(mesh.bounds, axis=0).max())
    if machine is not None and widest > WIDE * machine.work.diameter and not states_unit(job.mesh_path):
        size, width = (f"{from_si(value, 'mm'):.4g} mm" for value in (widest, machine.work.diameter))
        problems.append(
            f'the part is {size} wide, the work volume of the machine {width}: is unit = "{job.part.unit}" in [part] '
            "right?"
        )
    wide = getattr(job.tool.si, "diameter", None)
    if wide is not None and wide > widest and not states_unit(job.mesh_path):
        size, cutter = (f"{from_si(value, 'mm'):.4g} mm" for value in (widest, wide))
        problems.append(f'the part is {size} wide, the cutter {cutter}: is unit = "{job.part.unit}" in [part] right?')
    found = RegionShare.of(mesh, region)
    if found.inside <= 0.0:
        raise ToolpathError("the region holds nothing to machine", key="region", remedy=why_empty(mesh, region))
    if found.inside < LEAST_SHARE * found.facing:
        outside, steep = (found.facing - found.boxed) / found.facing, (found.boxed - found.inside) / found.facing
        boxed = f"{_percent(outside)} is outside region_box_mm (placement.setups takes a large part in several set-ups)"
        why = [boxed] if job.part.region_box_mm is not None else []
        degrees = from_si(region.within, "deg")
        why += [f"{_percent(steep)} is steeper than region_angle_deg = {degrees:g}"] if steep > 0.0 else []
        problems.append(f"less than half of what faces the direction is machined: {' and '.join(why)}")
    if found.facing < LEAST_SHARE and not mesh.diagnosis.watertight:
        problems.append(
            f"{_percent(1.0 - found.facing)} of this open surface faces away from region_direction: flip = true in "
            "[part] turns it over"
        )
    stepover, narrow = getattr(job.toolpath.si, "stepover", None), min(found.widths)
    if stepover is not None and stepover > narrow > 0.0:
        mm = from_si(narrow, "mm")
        problems.append(
            f"stepover_mm = {job.toolpath.stepover_mm:g} is wider than the region, {mm:.3g} mm across: one pass may be "
            "all there is"
        )
    return RegionReport(found, tuple(problems))


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
