"""Tool, tool axes and gouge check from a job."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.arrays import Floats
from pentapod.base.errors import ToolpathError
from pentapod.base.keys import fields_from, file_key
from pentapod.base.progress import Progress, silent
from pentapod.base.units import from_si
from pentapod.cutters.registry import CUTTERS
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import normalised
from pentapod.geometry.solids import Cone
from pentapod.job.build.strategy import job_sink
from pentapod.job.schema.job import Job
from pentapod.job.schema.strategies import FileTable
from pentapod.mesh.mesh import Mesh
from pentapod.toolpath.axis.modes import AxisMode, Between, Fixed, Normal, Pointed
from pentapod.toolpath.axis.orientation import Orientation
from pentapod.toolpath.axis.orienting import oriented
from pentapod.toolpath.axis.steps import fastest_turn, stepped
from pentapod.toolpath.gouge.gouge import without_gouges
from pentapod.toolpath.gouge.report import GougeOptions, Remedy
from pentapod.toolpath.linking.links import LinkStyle
from pentapod.toolpath.options import PathOptions
from pentapod.toolpath.toolpath import Toolpath

_SLACK = 1.05
"""The cap holds along the contact points; the path of the tilt centre is a little longer or shorter."""
_FILE_STYLE = PathOptions()
"""Clearance, approach and spacing where the path comes from a file."""


@dataclass(frozen=True)
class Reports:
    """The reports of the steps that made a toolpath."""

    parts: tuple[object, ...]

    def __str__(self) -> str:
        return "\n".join(str(part) for part in self.parts)


@dataclass(frozen=True)
class FileReport:
    """A toolpath that came from a file."""

    name: str
    waypoints: int
    segments: int

    def __str__(self) -> str:
        return f"{self.name}: {self.waypoints:,} waypoints in {self.segments:,} segments, read as they are"


@dataclass(frozen=True)
class TurnReport:
    """Axes that had to be tilted clear of a gouge turn faster than the job's cap, both in degrees per millimetre."""

    fastest: float
    most: float

    def __str__(self) -> str:
        return f"  problem: tilted clear, the axis turns by up to {self.fastest:.3g} deg/mm, the cap is {self.most:.3g}"


def job_tool(job: Job) -> Tool:
    """Return the job's tool. Raises JobError where its lengths make no tool."""
    cutter = CUTTERS[job.tool.type]
    mounted = {"shank": _cones(job.tool.si.shank), "holder": _cones(job.tool.si.holder)}
    try:
        return cutter(**fields_from(cutter, job.tool), **mounted)
    except ToolpathError as error:
        key = file_key(cutter, error.key or "") or "type"
        raise job.error("tool", key, error.what, expected=error.expected) from error


def job_orientation(job: Job) -> Orientation:
    """Return the nominal tool axis of the job."""
    return Orientation(mode=_mode(job), **fields_from(Orientation, job.axis))


def finished_as_asked(
    job: Job, mesh: Mesh, tool: Tool, toolpath: Toolpath, progress: Progress = silent
) -> tuple[Toolpath, object]:
    """Return a toolpath with the job's tool axes and gouge remedies applied, and the report of the gouge check."""
    from_file = isinstance(job.toolpath, FileTable)
    axis_step = np.inf if from_file else job.toolpath.si.axis_step
    if not from_file:
        toolpath = stepped(oriented(toolpath, tool, job_orientation(job)), axis_step)
    gouge = fields_from(GougeOptions, job.gouge)
    options = GougeOptions(
        # By default, nothing is taken out of a toolpath that was read from a file.
        tuple(Remedy(name) for name in job.gouge.remedy or ("report" if from_file else "drop",)),
        # An engraving lies below the surface on purpose.
        **{**gouge, "tolerance": gouge["tolerance"] + job_sink(job)},
        links=None if from_file else job_link_style(job, mesh, toolpath),
    )
    toolpath, report = without_gouges(toolpath, tool, mesh, options, progress)
    if not report.tilted:
        return toolpath, report
    # Tilted axes may turn faster than before.
    toolpath = stepped(toolpath, axis_step)
    fastest, most = float(from_si(fastest_turn(toolpath), "deg_mm")), from_si(job.axis.si.rate, "deg_mm")
    return toolpath, Reports((report, TurnReport(fastest, most))) if most and fastest > most * _SLACK else report


def job_link_style(job: Job, mesh: Mesh, toolpath: Toolpath) -> LinkStyle:
    """Return the style of additional links: along the axis and over the clearance level."""
    view = normalised(job.part.si.region_direction)
    top = max(float((mesh.vertices @ view).max()), float((toolpath.tips @ view).max()))
    style = _FILE_STYLE if isinstance(job.toolpath, FileTable) else job.toolpath.si
    level = top + max(style.clearance, 2.0 * style.approach)
    feed = job.feed.si.cut if job.feed.link_mm_min is None else job.feed.si.link
    return LinkStyle(view, level, style.approach, spacing=style.spacing, feed=feed)


def _mode(job: Job) -> AxisMode:
    axis = job.axis.si
    if axis.mode == "fixed":
        return Fixed(axis.direction)
    if axis.mode in ("toward", "from"):
        return Pointed(axis.point, None if axis.line is None else np.array(axis.line), toward=axis.mode == "toward")
    if axis.mode == "between":
        return Between(axis.places, np.array(axis.directions))
    return Normal()


def _cones(pieces: Floats | None) -> tuple[Cone, ...]:
    """Return the pieces of a shank or holder, rows of height, lower and upper diameter."""
    return () if pieces is None else tuple(Cone(height, 0.5 * low, 0.5 * high) for height, low, high in pieces.tolist())
