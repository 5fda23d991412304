"""From a job's tables to the values of the toolpath floor: the tool, its axes, what is done about gouges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pentapod.base.errors import ToolpathError
from pentapod.base.progress import Progress, silent
from pentapod.cutters.ball import BallCutter
from pentapod.cutters.bull_nose import BullNose
from pentapod.cutters.flat_end import FlatEnd
from pentapod.cutters.lollipop import Lollipop
from pentapod.cutters.stand_off import StandOff
from pentapod.cutters.tool import Tool
from pentapod.geometry.directions import normalised
from pentapod.geometry.solids import Cone
from pentapod.job.schema.job import Job
from pentapod.job.schema.strategies import FileTable, sunk_mm
from pentapod.job.schema.table import Vector
from pentapod.mesh.mesh import Mesh
from pentapod.mesh.query.tree import FacetTree
from pentapod.toolpath.axis.modes import AxisMode, Between, Fixed, Normal, Pointed
from pentapod.toolpath.axis.orientation import Orientation
from pentapod.toolpath.axis.orienting import oriented
from pentapod.toolpath.axis.steps import fastest_turn, stepped
from pentapod.toolpath.gouge.gouge import checked
from pentapod.toolpath.gouge.report import GougeOptions, Remedy
from pentapod.toolpath.linking.links import LinkStyle
from pentapod.toolpath.toolpath import Toolpath

_MM = 1e-3
_SLACK = 1.05
"""The cap counts along the contacts; the pivot's way is a little longer or shorter."""
_FILE_STYLE_MM = (10.0, 3.0, 2.0)  # clearance, approach and spacing, where the path comes from a file


@dataclass(frozen=True)
class Reports:
    """What the steps to a toolpath came to, one after the other."""

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
    table = job.tool
    mounted = {"shank": _cones(table.shank_mm), "holder": _cones(table.holder_mm)}
    radius, flute = 0.5 * _MM * (table.diameter_mm or 0.0), None if table.flute_mm is None else _MM * table.flute_mm
    try:
        if table.type == "ball":
            return BallCutter(radius, flute, **mounted)
        if table.type == "bull":
            return BullNose(radius, _MM * (table.corner_mm or 0.0), flute, **mounted)
        if table.type == "flat":
            return FlatEnd(radius, flute=flute, **mounted)
        if table.type == "lollipop":
            return Lollipop(radius, 0.5 * _MM * (table.neck_mm or 0.0), _MM * (table.reach_mm or 0.0), **mounted)
        return StandOff(_MM * (table.standoff_mm or 0.0), **mounted)
    except ToolpathError as error:
        key = {"corner": "corner_mm", "flute": "flute_mm", "neck_radius": "neck_mm", "reach": "reach_mm"}
        raise job.error("tool", key.get(error.key or "", "type"), error.what, expected=error.expected) from error


def job_orientation(job: Job) -> Orientation:
    """Return how the job wants the tool to stand."""
    table = job.axis
    return Orientation(
        mode=_mode(job),
        lead=float(np.radians(table.lead_deg)),
        tilt=float(np.radians(table.side_deg)),
        smoothing=float(np.radians(table.smoothing_deg)),
        reach=_MM * table.smoothing_reach_mm,
        rate=None if table.rate_deg_mm is None else float(np.radians(table.rate_deg_mm)) / _MM,
    )


def finished_as_asked(
    job: Job, mesh: Mesh, tool: Tool, toolpath: Toolpath, progress: Progress = silent
) -> tuple[Toolpath, object]:
    """Return a toolpath with the axes and without the gouges that the job asks for, and what the check found."""
    axis_step = np.inf if isinstance(job.toolpath, FileTable) else np.radians(job.toolpath.axis_step_deg)
    if not isinstance(job.toolpath, FileTable):
        toolpath = stepped(oriented(toolpath, tool, job_orientation(job)), axis_step)
    table = job.gouge
    options = GougeOptions(
        # A toolpath from a file is somebody's: nothing is taken out of it unasked.
        tuple(Remedy(name) for name in table.remedy or ("report" if isinstance(job.toolpath, FileTable) else "drop",)),
        # What is engraved is meant to be below the surface.
        tolerance=_MM * (table.tolerance_mm + sunk_mm(job.toolpath)),
        cone=float(np.radians(table.cone_deg)),
        highest=_MM * table.highest_mm,
        links=None if isinstance(job.toolpath, FileTable) else job_link_style(job, mesh, toolpath),
    )
    toolpath, report = checked(toolpath, tool, FacetTree.of(mesh), options, progress)
    if not report.tilted:
        return toolpath, report
    # What was tilted clear may turn faster than before.
    toolpath = stepped(toolpath, axis_step)
    fastest, most = float(np.degrees(fastest_turn(toolpath))) * _MM, job.axis.rate_deg_mm
    return toolpath, Reports((report, TurnReport(fastest, most))) if most and fastest > most * _SLACK else report


def job_link_style(job: Job, mesh: Mesh, toolpath: Toolpath) -> LinkStyle:
    """Return how ways are led that the toolpath did not have: along the axis and over the clearance level."""
    table, view = job.toolpath, normalised(job.part.region_direction)
    top = max(float((mesh.vertices @ view).max()), float((toolpath.tips @ view).max()))
    link = job.feed.cut_mm_min if job.feed.link_mm_min is None else job.feed.link_mm_min
    clearance, approach, spacing = _FILE_STYLE_MM
    if not isinstance(table, FileTable):
        clearance, approach, spacing = table.clearance_mm, table.approach_mm, table.spacing_mm
    level = top + _MM * max(clearance, 2.0 * approach)
    return LinkStyle(view, level, _MM * approach, spacing=_MM * spacing, feed=_MM * link / 60.0)


def _mode(job: Job) -> AxisMode:
    table = job.axis
    if table.mode == "fixed":
        return Fixed(table.direction or (0.0, 0.0, 1.0))
    if table.mode in ("toward", "from"):
        point = _MM * np.array(table.point_mm)
        return Pointed(point, None if table.line is None else np.array(table.line), toward=table.mode == "toward")
    if table.mode == "between":
        return Between(_MM * np.array(table.places_mm), np.array(table.directions))
    return Normal()


def _cones(pieces: tuple[Vector, ...] | None) -> tuple[Cone, ...]:
    return tuple(Cone(_MM * height, 0.5 * _MM * low, 0.5 * _MM * high) for height, low, high in pieces or ())
