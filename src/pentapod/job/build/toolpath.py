"""Tool and toolpath from a job: strategy or file, tool axes, gouge check, exact stops."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, cast
from weakref import WeakKeyDictionary

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import MeshError, ToolpathError
from pentapod.base.keys import fields_from
from pentapod.base.progress import Progress, silent, within
from pentapod.base.units import from_si
from pentapod.cutters.ball import BallCutter
from pentapod.cutters.mounted import BallEnded, Mounted
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import normalised
from pentapod.geometry.solids import Cone
from pentapod.job.build.process import with_process
from pentapod.job.build.region import RegionReport, covers_region, job_region, kept_axis, region_report
from pentapod.job.build.tool import job_tool
from pentapod.job.build.words import NO_CUT, in_words_of
from pentapod.job.schema.job import Job
from pentapod.job.schema.strategies import FILE
from pentapod.machine.machine import Machine
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.distance import TOOL_RESOLUTION_M
from pentapod.mesh.query.swept_depth import RESOLUTION_M
from pentapod.planning.limits.contacts import tool_comfort
from pentapod.planning.limits.limit import Comforts
from pentapod.planning.problem.weights import NEEDED_MARGIN
from pentapod.toolpath import toolpath_with_report
from pentapod.toolpath.axis.modes import AxisMode, Between, Fixed, Normal, Pointed
from pentapod.toolpath.axis.orientation import REACH_M, Orientation, oriented
from pentapod.toolpath.axis.steps import fastest_turn, stepped
from pentapod.toolpath.formats import read_toolpath
from pentapod.toolpath.formats.rotary import RotaryAxes
from pentapod.toolpath.gouge.gouge import without_gouges
from pentapod.toolpath.gouge.report import GougeOptions, Remedy
from pentapod.toolpath.lines.scallop import stepover_for
from pentapod.toolpath.linking.links import LinkStyle
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.path_report import PathReport, totals
from pentapod.toolpath.strategies.registry import STRATEGIES
from pentapod.toolpath.toolpath import SegmentKind, Toolpath

RATE_SLACK = 1.05
"""Factor on the cap of the axis's turn: it holds along the contact points, not along the tilt centres."""


_KNOWN: WeakKeyDictionary[Mesh, dict[tuple[Tool, PathOptions, bytes], tuple[Toolpath, PathReport]]] = (
    WeakKeyDictionary()
)
"""Toolpaths over parts that are in use: many changes of a job, as of its placement, leave its passes as they are."""

CHECKED = 0.9
"""Share of the stage's time after which the toolpath is there, and its gouges are looked for."""

BESIDE = 0.2
"""Share of the gouge tolerance that is kept for a motion beside the path."""


@dataclass(frozen=True)
class Reports:
    """The reports of the steps that made a toolpath."""

    parts: tuple[object, ...]

    def __str__(self) -> str:
        return "\n".join(str(part) for part in self.parts)


def machined_share(reports: Reports) -> float:
    """Return the share of the surface that the region of a job holds, 0 to 1; 1 where the job covers no region."""
    return next((part.share.inside for part in reports.parts if isinstance(part, RegionReport)), 1.0)


def stem_sentence(tool: Tool) -> str:
    """Return a sentence about a stem that is assumed; empty where there is none."""
    if not isinstance(tool, Mounted) or tool.stem is None:
        return ""
    wide = 2.0 * max(solid.largest_radius for solid in tool.solids)
    return (
        f"a stem of {from_si(wide, 'mm'):.4g} mm is assumed from the cutter up to the spindle, "
        f"{from_si(tool.stem, 'mm'):.4g} mm above the tip; if it is another, give tool.shank_mm"
    )


def judged_tool(job: Job, machine: Machine | None) -> Tool:
    """Return the tool that the toolpath is made for and judged with.

    Where the planner chooses the axes, that is the ball alone: it is at the same place whatever the axis. The planner
    keeps the rest of the tool clear of the part. Else shank and holder are larger, by the room that the planner needs
    and by what the motion may be beside the path, up to a share BESIDE of the gouge tolerance.
    """
    tool = job_tool(job, machine)
    if job.axis.mode == "auto" and isinstance(tool, BallEnded):
        return BallCutter(tool.radius)
    body = [solid for solid in tool.solids if solid.kind != "cutter"]
    if not body or not isinstance(tool, Mounted):
        return tool
    needed = NEEDED_MARGIN * tool_comfort(body, job.gouge.si.tolerance + job_depth(job), Comforts())
    room = needed + min(job.tolerance.si.path, BESIDE * job.gouge.si.tolerance)
    return cast(Any, dataclasses.replace(tool, reserve=room + TOOL_RESOLUTION_M + RESOLUTION_M))


def tool_in_world(job: Job, machine: Machine | None = None) -> Tool:
    """Return the tool whose shank and holder are kept clear of the part.

    Where the planner chooses the axes, a ball's cutting length counts as shank: it would cut into the part sideways.
    """
    tool = job_tool(job, machine)
    if job.axis.mode == "auto" and isinstance(tool, BallCutter) and tool.flute is not None:
        if tool.stem is not None:
            return dataclasses.replace(tool, flute=None)
        end = BallCutter(tool.radius)
        height = tool.flute - end.solids[-1].top
        if height > 0.0:
            beside = Cone(height, tool.radius, tool.radius)
            return dataclasses.replace(end, shank=(beside, *tool.shank), holder=tool.holder)
    return tool


def job_options(job: Job) -> PathOptions:
    """Return the options of the job's strategy, its files read.

    Raises ToolpathError for a drawing, picture or list of points that cannot be used.
    """
    options, feed = STRATEGIES[job.toolpath.strategy].options, job.feed.si
    return options(
        region=job_region(job),
        chordal=job.tolerance.si.chordal,
        feed=feed.cut,
        link_feed=feed.cut if feed.link is None else feed.link,
        **fields_from(options, job.toolpath, job.files),
    )


def job_depth(job: Job) -> float:
    """Return the depth below the surface at which the job's strategy cuts on purpose, metres."""
    strategy = job.toolpath.strategy
    return STRATEGIES[strategy].options.depth_of(job.toolpath.si) if strategy in STRATEGIES else 0.0


def job_toolpath(
    job: Job, mesh: Mesh, progress: Progress = silent, *, machine: Machine | None = None
) -> tuple[Toolpath, Reports]:
    """Return the job's toolpath, workpiece frame, and its reports. machine: as for `job_tool`.

    Raises ToolpathError where there is nothing to machine, or the toolpath file cannot be read.
    """
    tool, from_file = judged_tool(job, machine), job.toolpath.strategy == FILE
    region: list[object] = []
    if from_file:
        toolpath, report = _read(job, tool)
    else:
        asked = job_options(job)
        if covers_region(job):
            region.append(region_report(job, mesh, machine))
        try:
            toolpath, report = _along_the_part(
                mesh, tool, asked, kept_axis(job), within(progress, "toolpath", 0.0, CHECKED)
            )
        except (MeshError, ToolpathError) as error:
            raise in_words_of(job, error) from error
        toolpath = stepped(oriented(toolpath, tool, _orientation(job, tool)), job.toolpath.si.axis_step)
    options = gouge_options(job, _remedies(job), None if from_file else job_link_style(job, mesh, toolpath))
    toolpath, gouges = without_gouges(toolpath, tool, mesh, options, within(progress, "toolpath", CHECKED, 1.0))
    if not any(segment.kind is SegmentKind.CUT for segment in toolpath.segments):
        raise ToolpathError("no cut is left: cutter, shank or holder would cut into the part everywhere", key=NO_CUT)
    stem = stem_sentence(job_tool(job, machine))
    reports: list[object] = [*region, report, gouges]
    reports += [f"  note: {stem}"] if stem else []
    if gouges.tilted:  # the axes may turn faster than before
        toolpath = stepped(toolpath, np.inf if from_file else job.toolpath.si.axis_step)
        reports += _turns(toolpath, from_si(job.axis.si.rate, "deg_mm"))
    if job.feed.dwell_s is not None:
        toolpath = toolpath.stopping(job.feed.dwell_s)
    return with_process(job, toolpath), Reports((*reports, totals(toolpath)))


def _along_the_part(
    mesh: Mesh, tool: Tool, options: PathOptions, axis: Floats | None, progress: Progress
) -> tuple[Toolpath, PathReport]:
    """Return the toolpath and the report of a strategy, with the axes along the normals or along one direction."""
    known = _KNOWN.setdefault(mesh, {})
    key = tool, options, b"" if axis is None else axis.tobytes()
    if key not in known:
        known[key] = toolpath_with_report(mesh, tool, options, axis, progress)
    return known[key]


def _remedies(job: Job) -> tuple[Remedy, ...]:
    """Return what is done about gouges: by default, nothing is taken out of a toolpath that was read from a file."""
    usual = "report" if job.toolpath.strategy == FILE else "drop"
    return tuple(Remedy(name) for name in job.gouge.remedy or (usual,))


def gouge_options(job: Job, remedies: tuple[Remedy, ...], links: LinkStyle | None) -> GougeOptions:
    """Return the options of the job's gouge check. links: style of links that replace others."""
    gouge = fields_from(GougeOptions, job.gouge)
    # An engraving lies below the surface on purpose.
    return GougeOptions(remedies, **{**gouge, "tolerance": gouge["tolerance"] + job_depth(job)}, links=links)


def drops_gouges(job: Job) -> bool:
    """Return whether what gouges is taken out of the toolpath, so that no motion of it should meet the part."""
    return Remedy.DROP in _remedies(job)


def removes_gouges(job: Job) -> bool:
    """Return whether anything is done about gouges of the toolpath; else they are only reported."""
    return _remedies(job) != (Remedy.REPORT,)


def job_link_style(job: Job, mesh: Mesh, toolpath: Toolpath) -> LinkStyle:
    """Return the style of additional links: along the axis and over the clearance level."""
    view = normalised(job.part.si.region_direction)
    top = max(float((mesh.vertices @ view).max()), float((toolpath.tips @ view).max()))
    style = PathOptions() if job.toolpath.strategy == FILE else job.toolpath.si
    level = top + max(style.clearance, 2.0 * style.approach)
    feed = job.feed.si.cut if job.feed.link_mm_min is None else job.feed.si.link
    return LinkStyle(view, level, style.approach, spacing=style.spacing, feed=feed)


def _read(job: Job, tool: Tool) -> tuple[Toolpath, str]:
    """Return the toolpath of the job's file, and a sentence about it."""
    file, keys = job.files["file"], job.toolpath
    rotary = RotaryAxes.of(keys.rotary_axes, keys.si.rotary_centre, keys.si.pivot) if keys.rotary_axes else None
    read = read_toolpath(
        file, keys.format, tilt_centre=tool.tilt_centre, feed=job.feed.si.cut, chordal=job.tolerance.si.chordal,
        rotary=rotary, tool=keys.tool, unit=keys.unit,
    )  # fmt: skip
    # The job's tool is used, whatever tool the file names.
    read = dataclasses.replace(read, tilt_centre=tool.tilt_centre)
    notes = [note if note.startswith("problem: ") else f"note: {note}" for note in read.notes]
    told = f"{file.name}: {len(read):,} waypoints in {len(read.segments):,} segments"
    return read, "\n  ".join([told + ("" if notes else ", read as they are"), *notes])


def _turns(toolpath: Toolpath, most: float | None) -> list[str]:
    """Return what to report where tilted axes turn faster than the job's cap, degrees per millimetre."""
    fastest = float(from_si(fastest_turn(toolpath), "deg_mm"))
    if not most or fastest <= most * RATE_SLACK:
        return []
    return [f"  problem: tilted to avoid a gouge, the axis turns by up to {fastest:.3g} deg/mm, the cap is {most:.3g}"]


def _orientation(job: Job, tool: Tool) -> Orientation:
    """Return the nominal axes that a job asks for; smoothed over three stepovers, where it does not say."""
    orientation, path = Orientation(mode=job_axis_mode(job), **fields_from(Orientation, job.axis)), job.toolpath.si
    if orientation.reach is not None:
        return orientation
    stepover, scallop, radius = (getattr(path, "stepover", None), getattr(path, "scallop", None), tool.scallop_radius)
    if stepover is None and scallop is not None and radius is not None:
        stepover = float(stepover_for(min(scallop, radius), radius))
    return dataclasses.replace(orientation, reach=max(REACH_M, 3.0 * (stepover or 0.0)))


def job_axis_mode(job: Job) -> AxisMode:
    """Return the direction from which a job's tool axes are measured."""
    axis = job.axis.si
    if axis.mode == "fixed":
        return Fixed(axis.direction)
    if axis.mode in ("toward", "from"):
        return Pointed(axis.point, None if axis.line is None else np.array(axis.line), toward=axis.mode == "toward")
    if axis.mode == "between":
        return Between(axis.places, np.array(axis.directions))
    return Normal()
